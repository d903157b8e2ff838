//! Laws of grids: samples, interpolation, extrapolation, and exact minima.

mod exact_minima;
mod outside;
mod samples;
