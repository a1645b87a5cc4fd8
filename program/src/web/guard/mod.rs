//! In: requests from browsers and programs. Out: only those that may be answered: known host and origin, a session,
//! one operator, names that stay below their root.
//! Frame and unit: none; bytes, seconds.

mod door;
mod host;
mod lease;
mod names;
mod password;
mod places;
mod session;
mod tls;
mod tries;

pub use door::{Door, MOST_BODY, door};
pub use host::Hosts;
pub use lease::{IDLE, Leases, Tab};
pub use names::{plain, resolve};
pub use password::{hashed, verify};
pub use session::{Sessions, random_hex};
pub use tls::{Doorway, Peer, tls};
pub use tries::{Tried, Tries};
