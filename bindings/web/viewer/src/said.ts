// What the pages say of an error. The runtime's own sentences are English; in other languages a sentence of the page's for the error's kind
// stands in front of it.
import { PalpateError } from "../../module/palpate.js";
import { known, word, type Key } from "./words";

export function saidOf(error: unknown): string {
  const { message } = error as Error;
  if (!(error instanceof PalpateError)) return message;
  const kind = `runtime.${error.status}`;
  return known(kind) === undefined ? message : word(kind as Key, { text: message });
}
