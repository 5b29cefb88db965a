//! Statistical tests and picture comparison: numbers in, verdict out; knows no renderer.
