//! The information model: numbers of OPC 40100-1, its types, its structures, and the one vision system.

pub mod data;
pub mod ids;
pub mod system;
pub mod types;
