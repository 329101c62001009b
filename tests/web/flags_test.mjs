// node flags_test.mjs MODULE PALPATE_H: the module's flags are those of palpate.h, by name and value.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { pathToFileURL } from "node:url";

const [modulePath, header] = process.argv.slice(2);

test("the module exports each flag of a step under palpate.h's name, with its value, and no other one", async () => {
  const module = await import(pathToFileURL(modulePath));
  const expected = [...readFileSync(header, "utf8").matchAll(/^\s*PALPATE_(STEP_\w+)\s*= 1 << (\d+)/gm)].map(([, name, bit]) => [name, 2 ** Number(bit)]);
  assert.ok(expected.length >= 15, "the header's flags are found");
  assert.deepEqual(Object.entries(module).filter(([name]) => name.startsWith("STEP_")).sort(), expected.sort());
});
