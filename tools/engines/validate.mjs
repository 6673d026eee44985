// validate.mjs FILE: what Khronos' validator has to say about a glTF file, as JSON: numErrors, numWarnings, messages…
import { readFile } from "node:fs/promises";
import { validateBytes } from "gltf-validator";

const report = await validateBytes(new Uint8Array(await readFile(process.argv[2])));
process.stdout.write(JSON.stringify(report.issues));
