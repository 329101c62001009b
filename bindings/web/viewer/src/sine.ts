// Sine and cosine as runtime/base/sine.h computes them, so that motions and turns of a scene have the bits that palpate-run gives them: what browsers
// compute differs in the last digit.
export function sineCosine(x: number): { sine: number; cosine: number } {
  let halvings = 0;
  for (; Math.abs(x) > 0.0625; ++halvings) x *= 0.5;
  const square = x * x;
  let sine = 1, less = 1; // sin(x) / x, and (1 - cos(x)) / (x^2 / 2)
  for (let k = 10; k >= 2; k -= 2) {
    sine = 1 - (square / (k * (k + 1))) * sine;
    less = 1 - (square / ((k + 1) * (k + 2))) * less;
  }
  sine *= x;
  let fall = 0.5 * square * less; // 1 - cos(x)
  for (; halvings > 0; --halvings) {
    const doubled = 2 * sine * sine;
    sine = 2 * sine * (1 - fall);
    fall = doubled;
  }
  return { sine, cosine: 1 - fall };
}
