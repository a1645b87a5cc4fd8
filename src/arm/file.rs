//! In: a pose file. Out: its poses one after the other, as if the robot was led by hand from each to the next.
//! Frame and unit: base_from_flange, mm.

use super::{Arm, Mode, PoseSource, State, TimedPose};
use crate::fault::{Fault, Result};
use crate::geometry::{Base, Flange, Rigid};
use crate::recording::load_poses;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Poses that were read from a file. All readers of one file share one position in it.
#[derive(Clone)]
pub(super) struct PosesOfFile {
    name: String,
    poses: Arc<Vec<Rigid<Base, Flange>>>,
    next: Arc<AtomicUsize>,
}

impl PosesOfFile {
    pub fn open(name: &str, path: &Path) -> Result<PosesOfFile> {
        let poses = load_poses(path)?.poses;
        Ok(PosesOfFile { name: name.to_owned(), poses: Arc::new(poses), next: Arc::default() })
    }
}

impl PoseSource for PosesOfFile {
    fn pose(&mut self) -> Result<TimedPose> {
        let k = self.next.fetch_add(1, Ordering::Relaxed);
        let asked = Instant::now();
        let Some(pose) = self.poses.get(k) else {
            return Err(Fault::input(format!(
                "{}: pose {k} was asked for, the file has {}",
                self.name,
                self.poses.len()
            ))
            .cause("more pictures than poses")
            .next("write a pose for every picture, in the order of the pictures"));
        };
        Ok(TimedPose { base_from_flange: *pose, figure: None, asked, here: asked, device: None })
    }
}

impl Arm for PosesOfFile {
    fn name(&self) -> &str {
        &self.name
    }
    fn state(&mut self) -> Result<State> {
        let model = format!("{} poses of a file", self.poses.len());
        let (motor, busy, emergency_stop) = (None, None, None);
        Ok(State { model, mode: Mode::Unknown, motor, busy, emergency_stop, errors: vec![], tool: None, work: None })
    }
    fn watch(&self) -> Result<Box<dyn PoseSource>> {
        Ok(Box::new(self.clone()))
    }
}
