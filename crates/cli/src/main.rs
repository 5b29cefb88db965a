//! The program `tyndall`.
fn main() {}
