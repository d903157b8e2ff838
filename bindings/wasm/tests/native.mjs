// Does the module find what the program finds, bit for bit? And does it say what is wrong, and live on?
// node native.mjs FOLDER SDFTOOL: FOLDER is what build.sh made.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const [folder, program] = process.argv.slice(2).map(path => resolve(path));
const { load } = await import(pathToFileURL(join(folder, "sdftool.js")));
const sdf = await load();
const work = mkdtempSync(join(tmpdir(), "sdftool-wasm-"));
process.on("exit", () => rmSync(work, { recursive: true }));
process.chdir(work);
const sdftool = (...words) => execFileSync(program, words, { encoding: "utf8", maxBuffer: 2 ** 30, stdio: ["ignore", "pipe", "inherit"] });
const read = name => sdf.mesh(readFileSync(name), name);
// -0 differs from 0. What JSON cannot say, an infinite number, stands there as null.
const same = (ours, theirs, what) => assert(Object.is(ours, theirs ?? ours) && (theirs !== null || !Number.isFinite(ours)), `${what}: ${ours} here, ${theirs} by the program`);
const sames = (ours, theirs, what) => { assert.equal(ours.length, theirs.length, what); theirs.forEach((x, i) => same(ours[i], x, `${what} ${i}`)); };
const camel = name => name.replace(/_(.)/g, (_, letter) => letter.toUpperCase());

sdftool("demo", "-o", ".");
writeFileSync("tetrahedron.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
writeFileSync("open.off", "OFF\n5 4 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0.5 0.5 0.75\n3 0 1 4\n3 1 2 4\n3 2 3 4\n3 3 0 4\n");
writeFileSync("post.sdf.toml", '[field]\nshape = "smooth_union"\nblend = 0.1\nof = [\n{ shape = "capsule", a = [0, 0, 0], b = [0, 0, 1], radius = 0.2 },\n{ shape = "box", half_extents = [0.5, 0.5, 0.1] },\n]\n');
writeFileSync("patch.obj", Array.from({ length: 121 }, (_, i) => `v ${i % 11 / 5 - 0.6} ${(i / 11 | 0) / 5 - 0.55} ${0.4 + 0.3 * Math.sin(i)}\n`).join("")
  + Array.from({ length: 100 }, (_, i) => { const a = 11 * (i / 10 | 0) + i % 10 + 1; return `f ${a} ${a + 1} ${a + 12} ${a + 11}\n`; }).join(""));

let searches = 0, contacts = 0;
function compare(field, path, meshName, options) {
  const words = Object.entries(options).flatMap(([name, value]) => {
    const option = `--${name.replace(/[A-Z]/g, letter => "-" + letter.toLowerCase())}`;
    if (name == "pose") return ["--translate", value.translation.join(), "--rotate", "0,0,1,90"];
    return value === true ? [option] : [option, String(value)];
  });
  const theirs = JSON.parse(sdftool("contacts", meshName, path, ...words, "--json"));
  const ours = field.contacts(read(meshName), options);
  const what = `${meshName} on ${path} with ${words.join(" ")}`;
  assert.deepEqual([ours.elementCount, ours.searchedCount, ours.possibleCount, ours.undecidedCount, ours.count], [theirs.elements, theirs.passed_cull, theirs.possible, theirs.undecided, theirs.contacts.length], what);
  theirs.contacts.forEach((contact, i) => {
    for (const name of ["id", "slope", "distance", "lower_bound", "error_bound", "shape_lower_bound", "evaluations"]) same(ours[camel(name)][i], contact[name], `${what}: ${name}`);
    for (const name of ["point", "surface_point", "normal"]) sames(ours[camel(name)].slice(3 * i, 3 * i + 3), contact[name], `${what}: ${name}`);
    for (const name of ["weights", "vertices"]) sames(ours[name].slice(3 * i, 3 * i + contact[name].length), contact[name], `${what}: ${name}`);
    assert.equal(sdf.elementNames[ours.element[i]], contact.element, what);
    assert.equal(sdf.elementNames[ours.feature[i]], contact.feature, what);
    assert.equal(sdf.statusNames[ours.status[i]], contact.status, what);
    sames(ours.featureId.slice(2 * i, 2 * i + 2), [contact.feature_id].flat().concat(2 ** 32 - 1).slice(0, 2), what);
    assert.equal(Number(ours.key[i]), contact.key, what);
  });
  searches += 1;
  contacts += ours.count;
}

const points = Float64Array.from({ length: 3000 }, (_, i) => Math.sin(i * i) * 1.5);
writeFileSync("points.csv", Array.from({ length: 1000 }, (_, i) => points.slice(3 * i, 3 * i + 3).join()).join("\n"));
const pose = { translation: [0.25, -0.125, 0.5], rotation: [0, 0, Math.SQRT1_2, Math.SQRT1_2] };
const bakes = [
  ["body.obj", "cloth.obj", { res: 48 }],
  ["body.obj", "cloth.obj", { res: 80, layout: "sparse" }],
  ["body.obj", "cloth.obj", { res: 40, layout: "sparse", precision: "f32", sign: "winding", keepMesh: true }],
  ["tetrahedron.obj", "patch.obj", { res: 24, padding: 6 }],
  ["body.obj", "cloth.obj", { res: 40, precision: "u8" }],
  ["open.off", "patch.obj", { res: 32, layout: "sparse" }],
];
for (const [body, mesh, options] of bakes) {
  const words = Object.entries(options).flatMap(([name, value]) => value === true ? ["--keep-mesh"] : [`--${name}`, String(value)]);
  sdftool("bake", body, ...words, "-o", "native.sdf.h5");
  const field = sdf.bake(read(body), options);
  const stored = sdf.open(readFileSync("native.sdf.h5"), "native.sdf.h5");
  assert.deepEqual({ ...field.info, bounds: 0 }, { ...stored.info, bounds: 0 });
  const { distance, gradient, status } = field.sample(points);
  // Within the box and the band alone values are distances.
  assert.equal(status.length, 1000);
  const [low, high] = field.info.bounds;
  status.forEach((bits, i) => {
    const isInBox = [0, 1, 2].every(k => low[k] <= points[3 * i + k] && points[3 * i + k] <= high[k]);
    assert.equal(Boolean(bits & 2), !isInBox);
    assert.equal(Boolean(bits & 4), field.info.band != null && Math.abs(distance[i]) >= field.info.band);
  });
  sdftool("eval", "native.sdf.h5", "--points", "points.csv").trim().split("\n").slice(1).forEach((line, i) => {
    sames([distance[i], ...gradient.slice(3 * i, 3 * i + 3)], line.split(",").slice(3, 7).map(Number), `${body}: sample`);
  });
  for (const elements of ["faces", "edges", "vertices"]) {
    compare(field, "native.sdf.h5", mesh, { elements, margin: 0.01 });
    compare(stored, "native.sdf.h5", mesh, { elements, margin: 0.01, method: "fw" });
  }
  compare(field, "native.sdf.h5", mesh, { margin: 0.01, allMinima: true });
  compare(field, "native.sdf.h5", mesh, { margin: 0.01, complete: true });
  compare(field, "native.sdf.h5", mesh, { margin: 0.01, onePerFeature: true, method: "newton" });
  compare(field, "native.sdf.h5", mesh, { margin: 0.01, lean: true, method: "fw" });
  if (options.keepMesh) compare(field, "native.sdf.h5", mesh, { margin: 0.01, exact: true });
  // What is saved here, the program opens, and the reverse.
  writeFileSync("browser.sdf.h5", field.save());
  if (body != "open.off") sdftool("verify", "browser.sdf.h5", body);
  compare(sdf.open(stored.save()), "browser.sdf.h5", mesh, { margin: 0.01 });
  field.free();
  stored.free();
}
compare(sdf.open(readFileSync("post.sdf.toml"), "post.sdf.toml"), "post.sdf.toml", "patch.obj", { margin: 0.05 });
// A reduction keeps what the program keeps.
{
  const field = sdf.open(readFileSync("post.sdf.toml"), "post.sdf.toml");
  const all = field.contacts(read("patch.obj"), { margin: 0.05 });
  for (const count of [1, 8, 64]) {
    const theirs = JSON.parse(sdftool("contacts", "patch.obj", "post.sdf.toml", "--margin", "0.05", "--reduce", String(count), "--movement", "0.02", "--json"));
    const ours = field.contacts(read("patch.obj"), { margin: 0.05, reduce: { count, movement: 0.02 } });
    assert.deepEqual([ours.foundCount, ours.count, ours.shortfall], [all.count, theirs.contacts.length, theirs.reduced.shortfall]);
    assert.deepEqual([[...ours.id], [...ours.distance]], [theirs.contacts.map(contact => contact.id), theirs.contacts.map(contact => contact.distance)]);
    assert(ours.count <= count && ours.deepest == all.deepest && ours.count < all.count);
    assert.equal(field.page("reduced", read("patch.obj"), { margin: 0.05, reduce: { count, movement: 0.02 } }).count, ours.count);
  }
  assert.equal(all.foundCount, undefined);
}
console.log(`wasm: ${contacts} contacts of ${searches} searches as by the program, bit for bit`);
assert(contacts > 2000);

// Every wrong call has an error that says what is wrong, and harms nothing.
const tetrahedron = read("tetrahedron.obj");
const body = sdf.bake(tetrahedron, { res: 16 });
const freed = sdf.bake(tetrahedron, { res: 8 });
freed.free();
const before = body.sample(points).distance;
const wrong = [
  [() => sdf.mesh(new TextEncoder().encode("hello"), "hello.obj"), /hello.obj/],
  [() => sdf.open(new Uint8Array(100), "zero.h5"), /zero.h5/],
  [() => sdf.open(readFileSync("native.sdf.h5").subarray(0, 5000), "short.h5"), /short.h5/],
  [() => sdf.bake(tetrahedron, { resolution: 3 }), /unknown field `resolution`.*`res`/],
  [() => sdf.bake(tetrahedron, { res: 0 }), /res.*1 cell/],
  [() => sdf.bake(tetrahedron, { layout: "sparse", res: "32" }), /^Error: res: invalid type: string "32", expected u32$/],
  [() => sdf.bake(tetrahedron, { keepMesh: 1 }), /^Error: keepMesh: .*boolean/],
  [() => sdf.bake(tetrahedron, { maxError: true }), /^Error: maxError: give a positive length/],
  ...[0, 1001, 2 ** 32 - 1].map(band => [() => sdf.bake(tetrahedron, { layout: "sparse", band }), RegExp(`^Error: band ${band}: give 1 to 1000 cells$`)]),
  [() => sdf.bake(tetrahedron, { res: 64, voxelSize: 1 }), /one of them/],
  [() => sdf.bake(tetrahedron, { res: undefined, layout: "thick" }), /layout "thick".*dense/],
  [() => sdf.bake(tetrahedron, { res: parseInt("many") }), /^Error: res: NaN is not a finite number$/],
  [() => sdf.bake(tetrahedron, { voxelSize: NaN }), /voxelSize: NaN/],
  [() => sdf.bake(tetrahedron, { weld: -Infinity }), /weld: -Infinity/],
  [() => sdf.bake(tetrahedron, { maxError: "many" }), /maxError/],
  [() => sdf.bake(tetrahedron, { res: 5000 }), /needs .* bytes, and .* are free/],
  [() => sdf.bake(tetrahedron, { progress: 3 }), /^TypeError: progress: give a function$/],
  [() => sdf.bake(tetrahedron, { weld: 1e9 }), /use a smaller weld$/],
  ...["f".repeat(80), "f".repeat(62), "g".repeat(64), "+1".repeat(32)].map(sha256 => [() => sdf.bake(tetrahedron, { source: { sha256 } }), /^Error: source.sha256: give 64 hexadecimal digits$/]),
  [() => sdf.bake({ points: [0, 0, 0, 1], faces: [0, 0, 0] }), /three numbers/],
  [() => sdf.bake({ points: [0, 0, 0, 1, 0, 0, 0, 1, 0], faces: [0, 1, 7] }), /vertex 7|7/],
  [() => sdf.bake({ points: [NaN, 0, 0, 1, 0, 0, 0, 1, 0], faces: [0, 1, 2] }), /NaN|finite/],
  [() => sdf.bake(tetrahedron, { progress: () => { throw new Error("enough"); } }), /^Error: enough$/],
  [() => body.contacts({ points: [0, 0, 0], faces: [0, 1, 2] }), /vertex 1/],
  [() => body.contacts({ ...tetrahedron, faces: [0, NaN, 2] }), /^Error: faces\[1\]: NaN is not an index$/],
  [() => body.contacts({ ...tetrahedron, faces: [0, 1, 2.7] }), /faces\[2\]: 2.7/],
  [() => body.contacts({ ...tetrahedron, faces: new Float64Array([0, 1, 2.7]) }), /faces\[2\]: 2.7/],
  [() => body.contacts({ ...tetrahedron, faces: [2 ** 32, 1, 2] }), /faces\[0\]: 4294967296/],
  [() => body.contacts({ ...tetrahedron, faces: new Int32Array([0, 1, -3]) }), /faces\[2\]: -3/],
  [() => sdf.bake({ ...tetrahedron, faces: [[0, 1, 2]] }), /faces\[0\]: 0,1,2 is not an index/],
  [() => body.sample([[0, 0, 0], [1, 0, 0]]), /^Error: points\[0\]: 0,0,0 is not a number$/],
  [() => body.sample([0, 0, "0"]), /points\[2\]/],
  [() => body.sample(new BigInt64Array(3)), /points\[0\]/],
  [() => body.sample(new DataView(new ArrayBuffer(24))), /points: not an array of numbers/],
  [() => body.sample(3), /points: not an array of numbers/],
  [() => body.sample(), /points: not an array of numbers/],
  [() => sdf.bake(), /^TypeError: mesh: give points and faces$/],
  [() => body.contacts(), /^TypeError: mesh: give points and faces$/],
  [() => body.contacts({ points: tetrahedron.points }), /^TypeError: mesh: give points and faces$/],
  [() => body.contacts({ vertices: tetrahedron.points, indices: tetrahedron.faces }), /^TypeError: mesh: give points and faces$/],
  [() => body.contacts({ faces: [] }, { elements: "vertices" }), /^TypeError: mesh: give points$/],
  [() => body.page("page", { vertices: tetrahedron.points, indices: tetrahedron.faces }), /^TypeError: mesh: give points and faces$/],
  ...[undefined, null, 100, "[field]", ["[field]"], {}].flatMap(bytes => [
    [() => sdf.open(bytes), /^TypeError: bytes: give an ArrayBuffer or a view of one/],
    [() => sdf.mesh(bytes, "mesh.obj"), /^TypeError: bytes: give an ArrayBuffer or a view of one/],
  ]),
  ...[NaN, Infinity, 1e200].flatMap(x => {
    const points = [...tetrahedron.points.slice(0, 9), 0, x, 0];
    return [
      [() => body.contacts({ ...tetrahedron, points }), /^Error: 3 faces have coordinates that are not finite or too large, face 1 the first$/],
      [() => body.page("page", { ...tetrahedron, points }), /^Error: 3 faces have coordinates/],
      [() => body.contacts({ ...tetrahedron, points }, { elements: "edges", reduce: { count: 4, movement: 1 } }), /^Error: 3 edges have coordinates/],
      [() => body.contacts({ points }, { elements: "vertices" }), /^Error: 1 vertex has coordinates .*, vertex 3 the first$/],
    ];
  }),
  // What the page would show is checked as contacts are, also where there is nothing to show.
  [() => body.page("page", { points: [], faces: [0, 1, 2] }), /vertex 0/],
  [() => body.page("page", { points: [], faces: [] }, { reduce: { count: 0, movement: 1 } }), /1 to 64 can$/],
  // The caller's own errors are the caller's.
  [() => body.contacts(tetrahedron, { margin: { toJSON() { throw new RangeError("mine"); } } }), /^RangeError: mine$/],
  [() => body.contacts(tetrahedron, { margin: 1e3 }), /margin/],
  [() => body.contacts(tetrahedron, { margin: "1" }), /^Error: margin: .*string/],
  [() => body.contacts(tetrahedron, { pose: { translation: [0, 0] } }), /^Error: pose: .*length 2/],
  [() => body.contacts(tetrahedron, { pose: 3 }), /^Error: pose: .*an object with translation and rotation$/],
  [() => body.page("page", tetrahedron, { lean: "yes" }), /^Error: lean: .*boolean/],
  [() => body.contacts(tetrahedron, { margin: Infinity }), /margin: Infinity is not/],
  [() => body.contacts(tetrahedron, { budget: NaN }), /budget: NaN/],
  [() => body.contacts(tetrahedron, { pose: { translation: [0, NaN, 0] } }), /translation: NaN/],
  [() => body.contacts(tetrahedron, { elements: "corners" }), /faces, edges, vertices/],
  ...["guess", "sample4", "corners"].map(method => [() => body.contacts(tetrahedron, { method }), /give one of auto, certified, fw, pgd, newton, gss$/]),
  [() => body.contacts(tetrahedron, { method: "gss" }), /edges/],
  [() => body.contacts(tetrahedron, { exact: true }), /keepMesh: true$/],
  [() => body.contacts(tetrahedron, { reduce: { count: 65, movement: 1 } }), /^Error: reduce: 65 contacts/],
  [() => body.contacts(tetrahedron, { reduce: { count: 4, movement: 0 } }), /reduce: .*positive length/],
  [() => body.contacts(tetrahedron, { reduce: { count: 4 } }), /movement/],
  [() => body.contacts(tetrahedron, { pose: { rotation: [0, 0, 0, 0] } }), /quaternion/],
  [() => freed.sample([0, 0, 0]), /freed/],
  // What JSON would leave out.
  [() => body.contacts(tetrahedron, { margin: () => 1 }), /^TypeError: margin: give a number, a text, true or false, not a function$/],
  [() => body.contacts(tetrahedron, { progress() {} }), /^TypeError: progress: /],
  [() => sdf.bake(tetrahedron, { res: Symbol("8") }), /^TypeError: res: .*not a symbol$/],
  ...[new Map([["margin", 0.1]]), [0.1], 0.1, () => 1].map(options => [() => body.contacts(tetrahedron, options), /^TypeError: options: give an object/]),
  [() => sdf.bake(tetrahedron, new Map([["res", 8]])), /^TypeError: options: give an object/],
  [() => sdf.bake(tetrahedron, { sign: "guess" }), /give one of auto, pseudo-normal, winding$/],
  [() => sdf.bake(tetrahedron, { source: 5 }), /^Error: source: .*an object with name and sha256$/],
  [() => sdf.mesh(new Uint8Array(8)), /^TypeError: name: give the name of the file/],
  [() => sdf.open(new Uint8Array(8), 5), /^TypeError: name: give the name of the file/],
  [() => body.page(), /^TypeError: name: give the name of the file/],
  [() => body.page(5), /^TypeError: name: give the name of the file/],
];
for (const [call, message] of wrong) assert.throws(call, message, String(call));
// Null stands for no options.
assert.deepEqual([body.contacts(tetrahedron, null).point, body.page("page", tetrahedron, null).html], [body.contacts(tetrahedron).point, body.page("page", tetrahedron).html]);
// And for the default of one of them.
const nothing = Object.fromEntries(["margin", "allMinima", "complete", "exact", "onePerFeature", "lean", "method"].map(name => [name, null]));
assert.deepEqual(body.contacts(tetrahedron, nothing).point, body.contacts(tetrahedron).point);
assert.equal(sdf.bake({ ...tetrahedron, source: null }, { keepMesh: null }).info.errorBound, sdf.bake(tetrahedron).info.errorBound);
assert.equal(sdf.bake(tetrahedron, null).info.errorBound, sdf.bake(tetrahedron, { progress: null }).info.errorBound);
// Other types whose numbers stay the same are taken.
assert.deepEqual(body.sample([...points]).distance, before);
assert.deepEqual(body.contacts({ points: new Float32Array(tetrahedron.points), faces: new Int16Array(tetrahedron.faces) }).point, body.contacts(tetrahedron).point);
assert.deepEqual(body.sample(points).distance, before);
assert.deepEqual(body.contacts({ points: tetrahedron.points }, { elements: "vertices" }).point, body.contacts(tetrahedron, { elements: "vertices" }).point);
// The same bytes in any view, or in memory of several workers.
const text = readFileSync("tetrahedron.obj");
assert(text.length % 2 == 0);
const shared = new SharedArrayBuffer(text.length);
new Uint8Array(shared).set(text);
const copy = Uint8Array.from([0, 0, ...text, 10, 10]).buffer;
for (const bytes of [Uint8Array.from(text).buffer, shared, new DataView(copy, 2, text.length), new Uint16Array(copy, 2, text.length / 2), new Int8Array(shared)]) {
  assert.deepEqual(sdf.mesh(bytes, "tetrahedron.obj"), tetrahedron);
}
const stored = body.save();
assert.deepEqual(sdf.open(new DataView(stored.buffer)).save(), stored);
let steps = 0;
sdf.bake(tetrahedron, { res: 32, progress: (done, total) => { assert(done <= total); steps += 1; } }).free();
assert(steps > 0);
for (const thrown of [undefined, null, 0]) assert.throws(() => sdf.bake(tetrahedron, { res: 8, progress: () => { throw thrown; } }), error => error === thrown);
// A bake in the progress of another leaves it its progress, and its end.
let outer = 0, inner = 0;
sdf.bake(tetrahedron, { res: 32, progress: () => { outer += 1; sdf.bake(tetrahedron, { res: 8, progress: () => { inner += 1; } }).free(); } }).free();
assert.equal(outer, steps);
assert(inner >= outer);
let calls = 0;
const ended = () => { if (++calls == 3) throw new Error("enough"); sdf.bake(tetrahedron, { res: 8 }).free(); };
assert.throws(() => sdf.bake(tetrahedron, { res: 32, progress: ended }), /^Error: enough$/);

// A module of its own, and what it exports.
async function loadOpened() {
  let exports;
  const { Instance } = WebAssembly;
  WebAssembly.Instance = class extends Instance { constructor(...words) { super(...words); exports = this.exports; } };
  const sdf = await load();
  WebAssembly.Instance = Instance;
  return { sdf, exports };
}

// Samples take their points (24 bytes) and answers (33) in the module, and a MiB for a block of them and the rest.
{
  const { sdf: fresh, exports } = await loadOpened();
  const field = fresh.open(stored), start = exports.memory.buffer.byteLength, count = 2 ** 20;
  field.sample(new Float64Array(3 * count));
  const taken = exports.memory.buffer.byteLength - start;
  assert(taken <= 57 * count + 2 ** 20, `${taken} bytes for ${count} samples`);
}

// An array of numbers is one, typed or not.
{
  const [translation, rotation] = [[0.1, 0.2, 0.3], [0, 0, 0.6, 0.8]];
  const typed = body.contacts(tetrahedron, { margin: 0.2, pose: { translation: new Float64Array(translation), rotation: new Float64Array(rotation) } });
  assert.deepEqual(typed.point, body.contacts(tetrahedron, { margin: 0.2, pose: { translation, rotation } }).point);
  assert.throws(() => body.contacts(tetrahedron, { pose: { translation: new Float32Array([0, NaN, 0]) } }), /translation: NaN/);
}

// A call where the stack is full ends the module, and says why.
{
  const { sdf: full } = await loadOpened();
  const field = full.open(stored);
  const deeper = () => { try { deeper(); } catch (error) { if (!full.isDead) field.contacts(tetrahedron, { margin: 0.2, method: "certified" }); } };
  let reason;
  try { deeper(); } catch (error) { reason = error; }
  assert(!full.isDead || !/out of memory/.test(reason.message), reason?.message);
}

// Addresses above 2 GiB. Pages that nobody writes to take no memory.
{
  const { sdf: high, exports } = await loadOpened();
  exports.memory.grow(2 ** 15);
  const field = high.open(stored);
  const count = 100, many = new Float64Array(count * points.length).map((_, i) => points[i % points.length]);
  const { distance } = field.sample(many);
  assert(exports.sdf_output(0) < 0);
  distance.forEach((x, i) => same(x, before[i % before.length], "sample above 2 GiB"));
}

// More memory than there is.
assert.throws(() => body.sample(new Float64Array(2 ** 28)), /out of memory/);
assert.deepEqual(body.sample(points).distance, before);
console.log(`wasm: ${wrong.length} wrong calls and a call without memory refused`);
