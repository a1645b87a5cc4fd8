//! Parses the option for the camera's mount.

use crate::cli::terminal::console::Console;
use sheetlight::calibrate::hand_eye::options::Mount;
use sheetlight::fault::Result;
use sheetlight::station::{Settings, mount_of};
use std::path::Path;

/// Where the camera is.
#[derive(clap::Args)]
pub struct Where {
    /// Where the camera is: eye-in-hand (on the flange) or eye-to-hand (fixed) [default: the station's, else
    /// eye-in-hand with a note]
    #[arg(long, value_parser = crate::cli::terminal::arguments::parse::<Mount>)]
    mount: Option<Mount>,
}

impl Where {
    /// The station's mount; an assumption is reported.
    pub fn of(&self, station: &Path, settings: &Settings, console: &Console) -> Result<Mount> {
        let mounted = mount_of(station, settings, self.mount)?;
        mounted.assumed.iter().for_each(|why| console.say(why));
        Ok(mounted.mount)
    }
}
