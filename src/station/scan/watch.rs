//! In: finished profiles of a running scan. Out: the same profiles for an observer, e.g. a screen.
//! Frame and unit: points in the cloud's frame, mm; `up` is a unit vector in it.

use crate::geometry::Vec3;
use crate::scan::Profile;
use std::fmt;
use std::sync::Arc;

/// An observer's function.
type Look = dyn Fn(&Profile, &Vec3) + Send + Sync;

/// An observer of a running scan; by default none. The scan waits for its function, which therefore has to be
/// short.
#[derive(Clone, Default)]
pub struct Watch(Option<Arc<Look>>);

impl Watch {
    /// `look` receives each profile that reached the cloud, with the direction towards the camera.
    pub fn new(look: impl Fn(&Profile, &Vec3) + Send + Sync + 'static) -> Watch {
        Watch(Some(Arc::new(look)))
    }

    pub(super) fn show(&self, profile: &Profile, up: &Vec3) {
        if let Some(look) = &self.0 {
            look(profile, up);
        }
    }
}

impl fmt::Debug for Watch {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(if self.0.is_some() { "watched" } else { "unwatched" })
    }
}
