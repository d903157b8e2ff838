/** sdftool: signed distance fields of meshes, and contacts of meshes with them. Distances are negative inside, lengths in the mesh's unit. */

/** Loads the module: from beside this file, from a URL, or from its bytes. */
export function load(source?: string | URL | ArrayBuffer | ArrayBufferView): Promise<Sdftool>;

/** The bytes of a file. */
export type Bytes = ArrayBuffer | SharedArrayBuffer | ArrayBufferView;
/** Bytes of their own, not in shared memory: of TypeScript before 5.7 too. */
export type OwnBytes = ReturnType<Uint8Array["slice"]>;
/** Numbers in any array. */
export type Numbers =
  | readonly number[] | Float64Array | Float32Array
  | Uint32Array | Int32Array | Uint16Array | Int16Array | Uint8Array | Uint8ClampedArray | Int8Array;

/** Points x, y, z one after the other; for each face the indices of its three points. What is not a number, or no index, is refused. */
export interface Mesh {
  points: Numbers;
  /** Contacts of vertices need none. */
  faces: Numbers;
  /** The file it was read from; kept in the field. */
  source?: { name: string; sha256: string };
}

/** As the options of `sdftool bake`; give at most one of res, voxelSize and maxError. */
export interface BakeOptions {
  /** Cells along the longest side of the mesh's box [64]. */
  res?: number;
  /** Side of a cell. */
  voxelSize?: number;
  /** The largest voxels that certify this error: a length, or text such as "0.1%" of the diagonal. The grid is sparse. */
  maxError?: number | string;
  /** "sparse": bricks near the surface [dense]. */
  layout?: "dense" | "sparse";
  /** Type of a sample [f32; u16 of a sparse grid]. */
  precision?: "f32" | "u16" | "u8";
  /** How inside and outside are told apart: for closed surfaces, or also for open ones [auto]. */
  sign?: "auto" | "pseudo-normal" | "winding";
  /** Half width of a sparse grid's band, 1 to 1000 cells [3]. */
  band?: number;
  /** Cells around the mesh's box [4]. */
  padding?: number;
  /** Closed shells inside of the solid [drop]. */
  innerFaces?: "drop" | "keep";
  /** Keep the mesh, for exact contacts. */
  keepMesh?: boolean;
  /** Vertices at most this far from each other become one. */
  weld?: number;
  /** Holes at most this large are capped. */
  close?: number;
  /** Steps done, and all as far as known. An exception in it ends the bake and is thrown again. */
  progress?: (done: number, total: number) => void;
}

/** As the options of `sdftool contacts`. */
export interface ContactOptions {
  /** Elements with a distance of at most margin somewhere are contacts [0]. */
  margin?: number;
  elements?: "faces" | "edges" | "vertices";
  /** gss is for edges alone. */
  method?: "auto" | "certified" | "fw" | "pgd" | "newton" | "gss";
  /** Where the field stands: turned by a quaternion x, y, z, w, then moved. */
  pose?: { translation?: [number, number, number]; rotation?: [number, number, number, number] };
  /** Evaluations of auto (256) and certified (1024), iterations of other methods (32). 0 counts as 1 evaluation, and as no iteration. */
  budget?: number;
  /** Of the certified minimum, in edge lengths, or sizes of the field if that is less [1e-3]. */
  tolerance?: number;
  /** Every isolated minimum of an element. */
  allMinima?: boolean;
  /** Leave out no element that the baked mesh has within the margin. */
  complete?: boolean;
  /** Contacts by the triangles of the mesh that keepMesh kept. */
  exact?: boolean;
  /** One contact for each vertex, edge or face that is touched. */
  onePerFeature?: boolean;
  /** Without smooth normals and error bounds, in less time; the same points and distances. */
  lean?: boolean;
  /**
   * Keep the at most count (1 to 64) contacts that hold a rigid body as all of them do. movement is how far the body moves until the next
   * search: the way of the middle of the box around the contacts' points plus the turn in radians times half of that box's diagonal.
   * thickness: the distance from the surface at which a solver holds those that are kept [0].
   */
  reduce?: { count: number; movement: number; thickness?: number };
}

/** Counts of a search. */
export interface ContactSummary {
  count: number;
  /** With reduce: how many there were before. */
  foundCount?: number;
  /** With reduce: how far any other can sink in the movement, where those that are kept are held. */
  shortfall?: number;
  elementCount: number;
  searchedCount: number;
  possibleCount: number;
  /** Elements without a contact of which auto and certified did not prove in their budget that there is none: a larger budget or a smaller tolerance decides. */
  undecidedCount: number;
  insideCount: number;
  /** The lowest distance; null where there is no contact. */
  deepest: number | null;
}

/** One entry a contact, in the order of elements; three numbers a contact where it says so. Columns are those of docs/contacts.md. */
export interface Contacts extends ContactSummary {
  /** Index among the faces, edges or vertices. */
  id: Uint32Array;
  /** Three a contact: where on the element the distance is lowest. */
  point: Float64Array;
  /** Three a contact: near the surface. */
  surfacePoint: Float64Array;
  /** Three a contact: out of the field. */
  normal: Float64Array;
  distance: Float64Array;
  /** Of the distance on the whole element. */
  lowerBound: Float64Array;
  /** Length of the gradient. */
  slope: Float64Array;
  /** How far the grid can be off here; infinite where nothing is known. */
  errorBound: Float64Array;
  shapeLowerBound: Float64Array;
  /** Three a contact: barycentric. */
  weights: Float64Array;
  /** Element and feature, the same from frame to frame. */
  key: BigUint64Array;
  /** Three a contact; 4294967295 where there is none. */
  vertices: Uint32Array;
  /** Two a contact: a vertex, an edge's two, or a face; else 4294967295. */
  featureId: Uint32Array;
  evaluations: Uint32Array;
  /** Index into elementNames. */
  element: Uint32Array;
  /** The part that the point lies on: index into elementNames. */
  feature: Uint32Array;
  /** Index into statusNames. */
  status: Uint32Array;
}

/** What is known of a field. Grids alone have those that may be missing. */
export interface FieldInfo {
  layout: "dense" | "sparse" | "closed form";
  /** Lowest and highest corner of the box; null where it has no end. */
  bounds: [(number | null)[], (number | null)[]];
  slopeBound: number;
  precision?: "f32" | "u16" | "u8";
  /** Nodes along x, y and z. */
  shape?: [number, number, number];
  spacing?: number;
  /** Certified: in the box of a dense grid, in the band of a sparse one; null where none is. */
  errorBound?: number | null;
  band?: number | null;
  /** The largest margin that the grid can answer. */
  maxMargin?: number;
  signMethod?: string;
  signReason?: string;
}

/** A loaded module. Its calls end when they are done: in a page, make them in a worker. All throw an Error that says what is wrong. */
export class Sdftool {
  private constructor();
  readonly version: string;
  readonly elementNames: readonly string[];
  readonly statusNames: readonly string[];
  /** Did a call run out of memory, or into a bug? Then every further call fails: load the module again. */
  readonly isDead: boolean;
  /** Reads OBJ, PLY, STL or OFF; the content says which. */
  mesh(bytes: Bytes, name: string): Mesh & { points: Float64Array; faces: Uint32Array };
  bake(mesh: Mesh, options?: BakeOptions | null): Field;
  /** Opens the bytes of .sdf.h5, .sdf.toml or .sdfb. */
  open(bytes: Bytes, name?: string): Field;
}

/** A signed distance field. */
export class Field {
  private constructor();
  readonly info: FieldInfo;
  /**
   * Does the sign change at triangles alone? Of baked fields; not so at the holes of an open mesh: the error bound is that of a distance
   * with the sign of a cell's corners where they agree.
   */
  readonly isSignContinuous?: boolean;
  /**
   * Distances, NaN at points that are not finite or beyond 1e150; three numbers a point; and a status a point: 0 where the distance is within the error
   * bound, else a sum of 1: no derivative here, 2: outside of the grid's box, a lower bound, 4: beyond a sparse grid's band, outside a
   * lower bound and inside a coarse depth, 8: not finite.
   */
  sample(points: Numbers): { distance: Float64Array; gradient: Float64Array; status: Uint8Array };
  /** Throws where elements have a vertex that is not finite, or beyond 1e150; the error counts them and names the first. */
  contacts(mesh: Mesh, options?: ContactOptions | null): Contacts;
  contacts(mesh: Pick<Mesh, "points">, options: ContactOptions & { elements: "vertices" }): Contacts;
  /** The bytes of a .sdf.h5, or of a .sdf.toml, for `open` and for the program. */
  save(): OwnBytes;
  /** The page of `sdftool view` in UTF-8: the field, and a mesh with its contacts; throws as `contacts` does. */
  page(name: string, mesh?: Mesh, options?: ContactOptions | null): ContactSummary & { html: OwnBytes };
  page(name: string, mesh: Pick<Mesh, "points">, options: ContactOptions & { elements: "vertices" }): ContactSummary & { html: OwnBytes };
  /** Gives the memory back; the field cannot be used afterwards. */
  free(): void;
}
