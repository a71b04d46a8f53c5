//! brickmend
fn main() {}
