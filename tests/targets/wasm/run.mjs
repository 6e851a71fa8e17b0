// Runs the tiny render's module under node: node run.mjs MODULE.wasm
import { readFileSync } from "node:fs";

const { instance } = await WebAssembly.instantiate(readFileSync(process.argv[2]), {});
for (let method = 0; method < instance.exports.methods(); method++) {
  const fingerprint = BigInt.asUintN(64, instance.exports.render(method));
  console.log(fingerprint.toString(16).padStart(16, "0"));
}
