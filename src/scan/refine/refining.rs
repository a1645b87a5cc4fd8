//! Takes out of a whole cloud what its own lines show to be wrong: the scatter of the reported places, then what the
//! sheet's thickness does. Points are in the cloud's frame, mm.

use super::{PathFound, SheetFound, Straight, Thick, straight};
use crate::capture::Format;
use crate::fault::Result;
use crate::scan::{Along, CloudPoint, Extraction, PointSource, Shots};

/// What a cloud's lines show to be wrong with each other, as far as the settings ask for it.
pub struct Refining {
    /// How the reported places scatter, where a surface shows it.
    pub places: Option<PathFound>,
    /// The shots where the cloud shows that the camera was.
    pub shots: Shots,
    path: Option<Straight>,
    thick: Option<Thick>,
}

/// A cloud with its shots on the path that the camera went.
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
    /// Looks at a cloud in the order of its shots; `shots` says where they were reported.
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

    /// Whether the points become others.
    pub fn changes(&self) -> bool {
        self.path.is_some() || self.thick.is_some()
    }

    /// The path that the camera went, where its reported places scatter about it.
    pub fn path(&self) -> Option<&Straight> {
        self.path.as_ref()
    }

    /// Hands over the same cloud's points as they are without it, and says what the sheet's thickness did.
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
