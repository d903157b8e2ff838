// sdftool for browsers and node: signed distance fields of meshes, and contacts with them. sdftool.d.ts has the types.
//
//   const sdf = await load();
//   const body = sdf.bake(sdf.mesh(bytes, "dragon.obj"), { res: 128, layout: "sparse" });
//   const found = body.contacts({ points, faces }, { margin: 0.01 });
//
// Calls take as long as they take: in a page, make them in a worker (worker.js). A call that fails throws an Error that says why.

const F64S = 0, U32S = 1, BYTES = 2, TEXT = 3;

// Numbers of each contact, column after column, as `columns` of src/request.rs writes them.
const F64_COLUMNS = { weights: 3, point: 3, surfacePoint: 3, normal: 3, distance: 1, lowerBound: 1, slope: 1, errorBound: 1, shapeLowerBound: 1 };
const U32_COLUMNS = { key: 2, vertices: 3, featureId: 2, id: 1, evaluations: 1, element: 1, feature: 1, status: 1 };

export async function load(source = new URL("./sdftool.wasm", import.meta.url)) {
  return new Sdftool(await WebAssembly.compile(await bytesOf(source)));
}

async function bytesOf(source) {
  if (source instanceof ArrayBuffer) return source;
  if (ArrayBuffer.isView(source)) return new Uint8Array(source.buffer, source.byteOffset, source.byteLength);
  if (new URL(source, import.meta.url).protocol == "file:" && globalThis.process?.versions?.node) {
    return (await import("node:fs/promises")).readFile(new URL(source, import.meta.url));
  }
  const response = await fetch(source);
  if (!response.ok) throw new Error(`${source}: ${response.status} ${response.statusText}`);
  return response.arrayBuffer();
}

// JSON has null for a number that is not finite, and null means the default; functions and symbols it leaves out, and of an array of numbers
// it makes an object.
function finite(name, value) {
  if (typeof value == "function" || typeof value == "symbol") throw new TypeError(`${name}: give a number, a text, true or false, not a ${typeof value}`);
  if (ArrayBuffer.isView(value) && "length" in value) return Array.from(value, x => finite(name, x));
  const wrong = [value].flat().find(x => typeof x == "number" && !Number.isFinite(x));
  if (wrong !== undefined) throw new Error(`${name}: ${wrong} is not a finite number`);
  return value;
}

// Points or faces as they were given. A typed array would take what is not of its kind for other numbers.
function numbers(name, values, Kind) {
  if (values instanceof Kind) return values;
  if (!Array.isArray(values) && !(ArrayBuffer.isView(values) && "length" in values)) throw new Error(`${name}: not an array of numbers`);
  const isIndex = value => Number.isInteger(value) && value >= 0 && value < 2 ** 32;
  const [fits, what] = Kind == Uint32Array ? [isIndex, "an index"] : [value => typeof value == "number", "a number"];
  for (let i = 0; i < values.length; i++) if (!fits(values[i])) throw new Error(`${name}[${i}]: ${String(values[i])} is not ${what}`);
  return values;
}

// Bytes of a file. Numbers of two bytes or text would be taken for others.
function fileBytes(bytes) {
  if (ArrayBuffer.isView(bytes)) return new Uint8Array(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  // An ArrayBuffer of another frame is not an instance of ours.
  if (/^\[object (Shared)?ArrayBuffer\]$/.test(Object.prototype.toString.call(bytes))) return new Uint8Array(bytes);
  throw new TypeError("bytes: give an ArrayBuffer or a view of one, such as a Uint8Array");
}

// Options by their names, without those that are null. A map or an array has none, and would be taken for no options.
function named(options = {}) {
  if (options === null) return {};
  if (Object.prototype.toString.call(options) != "[object Object]") throw new TypeError("options: give an object, such as { margin: 0.01 }");
  return Object.fromEntries(Object.entries(options).filter(([, value]) => value !== null));
}

function nameOf(name) {
  if (typeof name != "string") throw new TypeError('name: give the name of the file as text, such as "dragon.obj"');
  return name;
}

// A mesh with what is needed of it. One whose parts have other names would be taken for an empty one.
function meshOf(mesh, needsFaces = true) {
  if (mesh?.points == undefined || (needsFaces && mesh.faces == undefined)) throw new TypeError(`mesh: give points${needsFaces ? " and faces" : ""}`);
  return mesh;
}

// Addresses and lengths come as signed numbers: negative from 2 GiB on.
const unsigned = number => number >>> 0;

export class Sdftool {
  #exports; #progress; #thrown; #panic; #end;

  constructor(module) {
    const imports = { sdftool: { progress: (done, total) => this.#onProgress(done, total), panicked: (text, length) => { this.#panic = this.#string(text, length); } } };
    this.#exports = new WebAssembly.Instance(module, imports).exports;
    Object.assign(this, this.call({ call: "about" }).answer);
  }

  get isDead() {
    return this.#end !== undefined;
  }

  mesh(bytes, name) {
    const { answer, f64s, u32s } = this.call({ call: "mesh", name: nameOf(name) }, { bytes: fileBytes(bytes) });
    return { points: f64s, faces: u32s, source: answer.source };
  }

  bake(mesh, options) {
    const [{ points, faces, source }, { progress, ...words }] = [meshOf(mesh), named(options)];
    if (progress != undefined && typeof progress != "function") throw new TypeError("progress: give a function");
    // A bake in the progress of another.
    const outer = [this.#progress, this.#thrown];
    [this.#progress, this.#thrown] = [progress, undefined];
    try {
      const { answer } = this.call({ call: "bake", options: { ...named({ source }), ...words } }, { f64s: points, u32s: faces });
      return new Field(this, answer);
    } catch (error) {
      throw this.#thrown ? this.#thrown.error : error;
    } finally {
      [this.#progress, this.#thrown] = outer;
    }
  }

  open(bytes, name = "field") {
    return new Field(this, this.call({ call: "open", name: nameOf(name) }, { bytes: fileBytes(bytes) }).answer);
  }

  #onProgress(done, total) {
    // An exception must not pass through the module, which could not clear up.
    try {
      this.#progress?.(done, total);
      return 0;
    } catch (error) {
      // Anything can be thrown, undefined too.
      this.#thrown = { error };
      return 1;
    }
  }

  // Writes arrays and a request into the module, runs it, and copies the answer out. Not for users.
  call(request, { f64s = [], u32s = [], bytes = [] } = {}) {
    if (this.#end) throw new Error(`${this.#end}; load it again`);
    // What throws here is the caller's own, and leaves the module as it is.
    const [points, faces] = [numbers("points", f64s, Float64Array), numbers("faces", u32s, Uint32Array)];
    const text = new TextEncoder().encode(JSON.stringify(request, finite));
    try {
      this.#write(F64S, Float64Array, points);
      this.#write(U32S, Uint32Array, faces);
      this.#write(BYTES, Uint8Array, bytes);
      this.#write(TEXT, Uint8Array, text);
      const isDone = this.#exports.sdf_call();
      const said = new TextDecoder().decode(this.#read(TEXT, Uint8Array));
      if (!isDone) throw new Error(said);
      return { answer: JSON.parse(said), f64s: this.#read(F64S, Float64Array), u32s: this.#read(U32S, Uint32Array), bytes: this.#read(BYTES, Uint8Array) };
    } catch (error) {
      // A full stack is a RangeError of some browsers, and an InternalError of others.
      const isStack = /call stack|recursion/i.test(error.message) && (error instanceof RangeError || error.name == "InternalError");
      if (!(isStack || error instanceof WebAssembly.RuntimeError || error instanceof RangeError)) throw error;
      // What stopped the module left it in the middle of its work.
      const mebibytes = this.#exports.memory.buffer.byteLength / 2 ** 20;
      const panic = this.#panic && `sdftool ran into a bug: please report it: ${this.#panic}`;
      const stack = isStack && `the stack was full: call sdftool from fewer functions within each other (${error.message})`;
      this.#end = panic || stack || `out of memory with ${mebibytes} MiB: take larger voxels, a sparse grid, or fewer points at a time (${error.message})`;
      throw new Error(this.#end, { cause: error });
    }
  }

  // A view is made anew each time: memory that grows detaches the old ones.
  #write(buffer, Kind, values) {
    const place = unsigned(this.#exports.sdf_input(buffer, values.length));
    if (!place) throw new Error(`out of memory: ${values.length * Kind.BYTES_PER_ELEMENT} bytes are too many`);
    new Kind(this.#exports.memory.buffer, place, values.length).set(values);
  }

  #read(buffer, Kind) {
    const [place, count] = [this.#exports.sdf_output(buffer), this.#exports.sdf_output_count(buffer)].map(unsigned);
    return new Kind(this.#exports.memory.buffer, place, count).slice();
  }

  #string(text, length) {
    return new TextDecoder().decode(new Uint8Array(this.#exports.memory.buffer, unsigned(text), unsigned(length)));
  }
}

export class Field {
  #sdf; #number;

  constructor(sdf, { field, ...facts }) {
    this.#sdf = sdf;
    this.#number = field;
    Object.assign(this, facts);
  }

  sample(points) {
    const { f64s, bytes } = this.#call("sample", {}, { points: numbers("points", points, Float64Array) });
    return { distance: f64s.slice(0, f64s.length / 4), gradient: f64s.slice(f64s.length / 4), status: bytes };
  }

  contacts(mesh, options) {
    options = named(options);
    const { answer, f64s, u32s } = this.#call("contacts", { options }, meshOf(mesh, options.elements != "vertices"));
    const found = { ...answer };
    for (const [columns, numbers] of [[F64_COLUMNS, f64s], [U32_COLUMNS, u32s]]) {
      let start = 0;
      for (const [name, width] of Object.entries(columns)) found[name] = numbers.slice(start, start += width * answer.count);
    }
    found.key = new BigUint64Array(found.key.buffer);
    return found;
  }

  save() {
    return this.#call("save", {}).bytes;
  }

  page(name, mesh, options) {
    options = named(options);
    const { answer, bytes } = this.#call("page", { name: nameOf(name), options }, mesh === undefined ? {} : meshOf(mesh, options.elements != "vertices"));
    return { ...answer, html: bytes };
  }

  free() {
    if (this.#number !== undefined) this.#call("free", {});
    this.#number = undefined;
  }

  #call(call, rest, { points = [], faces = [] } = {}) {
    if (this.#number === undefined) throw new Error("the field was freed");
    return this.#sdf.call({ call, field: this.#number, ...rest }, { f64s: points, u32s: faces });
  }
}
