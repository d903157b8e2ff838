//! The program as a user sees it: output, files, refusals and exit statuses.

mod folder;
mod meshes;

mod all_minima;
mod blobs;
mod commands;
mod compare;
mod contact_files;
mod cuda;
mod dense_codes;
mod documents;
mod elements;
mod exact;
mod exchange;
mod fields;
mod fleet;
mod help;
mod hostile;
mod interrupted;
mod json;
mod lean;
mod overlap;
mod parts;
mod pictures;
mod poses;
mod progress;
mod reduce;
mod refusals;
mod repeatable;
mod shared_meshes;
mod simulate;
mod solids;
mod sparse_grids;
mod standard_output;
mod surfaces;
mod verify_sparse;
