//! The programs as their user meets them: what they print, what they write, what they refuse.

mod program;

mod accuracy;
mod help;
mod speed;
