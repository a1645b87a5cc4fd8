//! In: WGSL stages, bytes, and the order of the stages. Out: the bytes that the stages compute on a GPU, with timings.
//! Frame and unit: none. This module knows nothing of lasers, and is the only home of `wgpu`.

#[cfg_attr(not(target_os = "linux"), path = "no_alias.rs")]
mod alias;
mod background;
mod description;
mod device;
#[cfg(test)]
mod for_tests;
mod open;
mod rates;
mod recording;
mod ring;
mod specialise;
mod stage;
mod texels;
mod texels_trial;

pub use description::{Access, Binding, Field, Stage};
pub use device::{AdapterInfo, Buffer, Device, adapters};
pub use rates::Rates;
pub use recording::{Dispatch, Recording, Replay, StageTime};
pub use ring::{PART, Returned, Ring, RingSizes, Slot};
pub use stage::{Pipeline, Workload, run_once};
