//! In: a camera that is being watched, a setting. Out: its settings and their values; the changed setting.
//! Frame and unit: features by their standard names (SFNC).

use super::state::lock;
use super::watch::Camera;
use crate::web::message::{CameraFeature, CameraState, SetFeature};
use sheetlight::fault::Result;
use std::sync::Arc;

impl Camera {
    /// The camera's settings, as it last reported them; empty while it is not connected.
    pub fn features(&self) -> CameraState {
        let features = lock(&self.state).features.iter().flatten().map(CameraFeature::from).collect();
        CameraState { features }
    }

    /// Changes a setting; viewers wait for a moment.
    ///
    /// # Errors
    /// The camera refuses, is not connected, or a job uses it.
    pub fn set(&self, ask: &SetFeature) -> Result<CameraState> {
        self.lend_running(&Arc::default())?.set(&ask.name, &ask.value)?;
        Ok(self.features())
    }
}
