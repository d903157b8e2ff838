// The worker of index.html: bakes or opens the body, and finds the contacts of a mesh with it, apart from the page, which stays awake.
import { load } from "./sdftool.js";

let sdf, body, bodyName;

function requireBody() {
  if (!body) throw new Error("there is no body yet: drop its mesh first");
}

const stem = name => name.replace(/(\.sdf)?\.[^.]*$/, "");

const works = {
  // A field's file is opened, a mesh is baked.
  async body({ file, options }) {
    body?.free();
    body = undefined;
    const bytes = new Uint8Array(await file.arrayBuffer());
    let last = 0;
    const progress = (done, total) => {
      if (performance.now() > last + 50) postMessage({ progress: done / total }), last = performance.now();
    };
    body = /\.(h5|toml|sdfb)$/i.test(file.name) ? sdf.open(bytes, file.name) : sdf.bake(sdf.mesh(bytes, file.name), { ...options, progress });
    bodyName = stem(file.name);
    return { info: body.info, ...body.page(bodyName) };
  },
  async save() {
    requireBody();
    return { bytes: body.save(), name: `${bodyName}.sdf.${body.info.layout == "closed form" ? "toml" : "h5"}` };
  },
  async mesh({ file, options }) {
    requireBody();
    const mesh = sdf.mesh(new Uint8Array(await file.arrayBuffer()), file.name);
    return body.page(`${stem(file.name)} on ${bodyName}`, mesh, options);
  },
};

// One after the other, in the order of their messages.
let queue = Promise.resolve();
onmessage = ({ data: { work, ...given } }) => {
  queue = queue.then(async () => {
    try {
      sdf ??= await load();
      const started = performance.now();
      const done = await works[work](given);
      postMessage({ ended: work, done, seconds: (performance.now() - started) / 1000 });
    } catch (error) {
      if (sdf?.isDead) sdf = body = undefined;
      postMessage({ ended: work, error: error.message, isLost: !body });
    }
  });
};
