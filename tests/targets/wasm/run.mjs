// Runs the tiny render's module under node: node run.mjs MODULE.wasm
import { readFileSync } from "node:fs";

const { instance } = await WebAssembly.instantiate(readFileSync(process.argv[2]), {});
for (let program = 0; program < instance.exports.programs(); program++) {
  const fingerprint = BigInt.asUintN(64, instance.exports.run(program));
  console.log(fingerprint.toString(16).padStart(16, "0"));
}
