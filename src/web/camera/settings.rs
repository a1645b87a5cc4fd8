//! In: a camera that is looked at, a setting. Out: what it can be set to and is; the setting made.
//! Frame and unit: features by their standard names (SFNC).

use super::state::lock;
use super::watch::Camera;
use crate::fault::Result;
use crate::web::message::{CameraFeature, CameraState, SetFeature};
use std::sync::Arc;

impl Camera {
    /// What it can be set to, as it said last; nothing while it is not there.
    pub fn features(&self) -> CameraState {
        let features = lock(&self.state).features.iter().flatten().map(CameraFeature::from).collect();
        CameraState { features }
    }

    /// Sets it; who looks on waits for a moment.
    ///
    /// # Errors
    /// The camera refuses, is not there, or a job has it.
    pub fn set(&self, ask: &SetFeature) -> Result<CameraState> {
        self.lend_running(&Arc::default())?.set(&ask.name, &ask.value)?;
        Ok(self.features())
    }
}
