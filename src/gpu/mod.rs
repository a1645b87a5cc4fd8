//! In: WGSL stages, bytes, and what depends on what. Out: the same bytes computed on a GPU, with timings.
//! Frame and unit: none; knows no lasers. The only home of `wgpu`.

#[cfg_attr(not(target_os = "linux"), path = "no_alias.rs")]
mod alias;
mod background;
mod device;
mod rates;
mod recording;
mod ring;
mod specialise;
mod stage;
mod texels;

pub use device::{AdapterInfo, Buffer, Device, adapters};
pub use rates::Rates;
pub use recording::{Dispatch, Recording, Replay, StageTime};
pub use ring::{PART, Returned, Ring, RingSizes, Slot};
pub use stage::{Access, Binding, Field, Pipeline, Stage, Workload, run_once};
