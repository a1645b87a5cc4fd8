//! In: results, messages, signals. Out: stdout for data, stderr for people, options' values, the surroundings of
//! procedures, a scan that ends on request.
//! Frame and unit: none.

pub mod arguments;
pub mod console;
pub mod interrupt;
pub mod outputs;
pub mod printable;
pub mod surroundings;
pub mod threads;
