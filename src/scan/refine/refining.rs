//! Removes from a whole cloud the errors that its own lines show: first the scatter of the reported poses, then the
//! shifts caused by the sheet's thickness. Points are in the cloud's frame, mm.

use super::{PathFound, SheetFound, Straight, Thick, straight};
use crate::capture::Format;
use crate::fault::Result;
use crate::scan::{Along, CloudPoint, Extraction, PointSource, Shots};

/// Errors that a cloud's lines show relative to each other, as far as the settings ask for them.
pub struct Refining {
    /// Scatter of the reported poses, if a surface shows it.
    pub places: Option<PathFound>,
    /// The shots with the camera poses that the cloud shows.
    pub shots: Shots,
    path: Option<Straight>,
    thick: Option<Thick>,
}

/// A cloud with its shots moved to the camera's path.
struct OnPath<'a> {
    cloud: &'a dyn PointSource,
    path: Option<&'a Straight>,
}

impl PointSource for OnPath<'_> {
    fn for_each_chunk(&self, take: &mut dyn FnMut(&[CloudPoint])) -> Result<()> {
        let Some(path) = self.path else { return self.cloud.for_each_chunk(take) };
        let mut points: Vec<CloudPoint> = Vec::new();
        self.cloud.for_each_chunk(&mut |chunk| {
            points.clear();
            points.extend_from_slice(chunk);
            path.apply(&mut points);
            take(&points);
        })
    }
}

impl Refining {
    /// Examines a cloud in the order of its shots; `shots` holds their reported poses.
    ///
    /// # Errors
    /// Those of reading the cloud.
    pub fn of(cloud: &dyn PointSource, shots: Shots, format: Format, settings: &Extraction) -> Result<Refining> {
        let pixels = if shots.along == Along::U { format.width } else { format.height };
        let path = if settings.straighten { straight(cloud, &shots, pixels)? } else { None };
        let places = path.as_ref().map(|p| p.found);
        let path = path.filter(|p| p.found.taken_out);
        let shots = path.as_ref().map_or_else(|| shots.clone(), |p| p.shots(&shots));
        let on_path = OnPath { cloud, path: path.as_ref() };
        let thick = if settings.thick_sheet { Thick::of(&on_path, &shots)? } else { None };
        Ok(Refining { places, shots, path, thick })
    }

    /// Whether any point is changed.
    pub fn changes(&self) -> bool {
        self.path.is_some() || self.thick.is_some()
    }

    /// The camera's path, if the reported poses scatter about it.
    pub fn path(&self) -> Option<&Straight> {
        self.path.as_ref()
    }

    /// Passes the cloud's corrected points to `take`, and returns the effect of the sheet's thickness.
    ///
    /// # Errors
    /// Those of reading the cloud, and of `take`.
    pub fn apply(
        &self,
        cloud: &dyn PointSource,
        take: &mut dyn FnMut(&[CloudPoint]) -> Result<()>,
    ) -> Result<Option<SheetFound>> {
        let on_path = OnPath { cloud, path: self.path.as_ref() };
        if let Some(thick) = &self.thick {
            return thick.apply(&on_path, &self.shots, take).map(Some);
        }
        let mut taken = Ok(());
        on_path.for_each_chunk(&mut |points| {
            if taken.is_ok() {
                taken = take(points);
            }
        })?;
        taken.map(|()| None)
    }
}
