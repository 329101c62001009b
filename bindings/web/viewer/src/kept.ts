// What the browser keeps of a user's choices. A browser may forbid localStorage: then a choice holds until the page is left.
export function kept(name: string): string | null {
  try {
    return localStorage.getItem(name);
  } catch {
    return null;
  }
}

export function keep(name: string, value: string) {
  try {
    localStorage.setItem(name, value);
  } catch {
    // Not kept.
  }
}
