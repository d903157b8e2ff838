//! The programs as their user meets them: what they print, what they write, what they refuse.

mod program;

mod accuracy;
mod gpu;
mod help;
mod speed;
