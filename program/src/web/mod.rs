//! In: a station's folder. Out: the operator's screen, served to browsers.
//! It uses one port. Everything it does is a procedure of `station` that the command line offers too.
//! Frame and unit: as the procedures; texts show theirs.

mod api;
mod camera;
mod disk;
mod event;
mod for_cell;
mod found_part;
mod ghost;
mod guard;
mod message;
mod motion;
mod pages;
mod plc;
mod port;
mod robot;
mod screen;
mod serve;
mod settings;
mod simulated;
mod station;
mod surface;
mod sweep;
mod track;
mod work;

pub use api::openapi;
pub use event::{Broker, Names};
pub use for_cell::station_for;
pub use guard::{hashed, random_hex};
pub use message::{Mode, declarations};
pub use motion::SimulatedRobot;
pub use serve::{Opened, Secured, ServeOptions, serve};
pub use simulated::{SimulatedOptions, simulated};
