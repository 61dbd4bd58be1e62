// Tangents by mikktspace.c, as compiled in the npm package `mikktspace`: node reference.mjs corners.bin > tangents.bin
// In: float32, all positions (3 a corner), then all normals (3), then all UVs (2). Out: 4 a corner.
import fs from 'fs';
import {createRequire} from 'module';
const {generateTangents} = createRequire(import.meta.url)('mikktspace');
const data = fs.readFileSync(process.argv[2]);
const values = new Float32Array(data.buffer, data.byteOffset, data.length / 4), n = values.length / 8;
const tangents = generateTangents(values.slice(0, 3 * n), values.slice(3 * n, 6 * n), values.slice(6 * n));
fs.writeSync(1, new Uint8Array(tangents.buffer, tangents.byteOffset, tangents.byteLength));
