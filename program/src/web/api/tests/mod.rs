//! Tests of the interface as a whole.

#[cfg(test)]
mod documented;
#[cfg(test)]
mod queue;
