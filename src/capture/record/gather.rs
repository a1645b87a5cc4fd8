//! In: pictures of different exposures with the position of what moves, in the order of their arrival. Out: the
//! pictures of each pose, one of every exposure; those that belong to none, with the reason.
//! Frame and unit: as [`crate::capture::pair`].

use crate::capture::pair::{LeftOut, Paired, Still};
use crate::recording::Stand;

/// Motion beyond which it is another pose, in limits of rest.
const ANOTHER: f64 = 5.0;

/// Result of a picture.
pub(super) enum Gathered {
    /// It is kept until the other exposures of its pose arrive. The others were kept before and are left: the robot
    /// went on.
    Waits(Vec<LeftOut>),
    /// The pose is complete: its pictures, the shortest exposure first.
    Pose(Vec<Paired>),
    /// It is one more picture of a pose that is recorded, or of an exposure that is there.
    Spare,
    /// What moves is not where it stood for the others, or its position is unknown.
    Unknown(LeftOut),
}

/// Pictures of the present pose.
pub(super) struct Gather {
    /// One for each exposure, the shortest first.
    pictures: Vec<Option<Paired>>,
    still: Still,
    /// Where the pose stands whose pictures are gathered, and the one that was recorded last.
    here: Option<Stand>,
    recorded: Option<Stand>,
}

impl Gather {
    /// For this number of exposures.
    pub fn new(exposures: usize) -> Gather {
        let pictures = (0..exposures).map(|_| None).collect();
        Gather { pictures, still: Still::default(), here: None, recorded: None }
    }

    /// Number of pictures that are kept.
    pub fn kept(&self) -> usize {
        self.pictures.iter().flatten().count()
    }

    /// Takes a picture with exposure `index`.
    pub fn take(&mut self, shot: Paired, index: usize) -> Gathered {
        let Some(stand) = shot.stand else {
            let (id, host_ns) = (shot.picture.id, shot.picture.host_ns);
            return Gathered::Unknown(LeftOut { id, host_ns, why: "no pose is known".into() });
        };
        let Still { mm, deg, counts } = self.still;
        let same = Still { mm: ANOTHER * mm, deg: ANOTHER * deg, counts };
        if self.recorded.is_some_and(|last| same.check(&last, &stand).is_ok()) {
            return Gathered::Spare;
        }
        let moved = self.here.and_then(|here| self.still.check(&here, &stand).err());
        let left = moved.map_or(Vec::new(), |_| self.leave("it moved on"));
        self.here.get_or_insert(stand);
        if self.pictures[index].is_some() {
            return Gathered::Spare;
        }
        self.pictures[index] = Some(shot);
        if self.pictures.iter().any(Option::is_none) {
            return Gathered::Waits(left);
        }
        Gathered::Pose(self.pictures.iter_mut().filter_map(Option::take).collect())
    }

    /// The pose that was complete is recorded: further pictures of it are spare.
    pub fn recorded(&mut self) {
        self.recorded = self.here.take();
    }

    /// Forgets the present pose, complete or not; gives the pictures that were kept of it.
    pub fn leave(&mut self, why: &str) -> Vec<LeftOut> {
        self.here = None;
        let (kept, all) = (self.kept(), self.pictures.len());
        let left = |p: Paired| {
            let why = format!("{why} after {kept} of {all} exposures");
            LeftOut { id: p.picture.id, host_ns: p.picture.host_ns, why }
        };
        self.pictures.iter_mut().filter_map(Option::take).map(left).collect()
    }
}
