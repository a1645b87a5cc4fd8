//! In: shots. Out: their profiles, in order, while further shots are taken.
//! Frame and unit: robot's base, mm.

use crate::fault::Result;
use crate::scan::{Profile, Scanner, Source};
use std::collections::VecDeque;

/// The profiles of a scan that goes on. Each comes some shots after its picture, as it was measured: a whole scan also
/// corrects the poses' scatter and the sheet's thickness. After an error there is nothing more.
pub struct Profiles<'a> {
    source: Box<dyn Source + 'a>,
    scanner: Scanner,
    ready: VecDeque<Profile>,
    ended: bool,
}

impl<'a> Profiles<'a> {
    pub(super) fn new(source: Box<dyn Source + 'a>, scanner: Scanner) -> Profiles<'a> {
        Profiles { source, scanner, ready: VecDeque::new(), ended: false }
    }

    /// Takes one shot, or what is left after the last one.
    fn go_on(&mut self) -> Result<()> {
        match self.source.next() {
            Some(shot) => {
                self.scanner.push(shot.map_err(|bad| bad.fault)?)?;
                self.ready.extend(self.scanner.ready()?);
            }
            None => {
                self.ended = true;
                self.ready.extend(self.scanner.finish()?);
            }
        }
        Ok(())
    }
}

impl Iterator for Profiles<'_> {
    type Item = Result<Profile>;

    fn next(&mut self) -> Option<Result<Profile>> {
        while self.ready.is_empty() && !self.ended {
            if let Err(fault) = self.go_on() {
                self.ended = true;
                return Some(Err(fault));
            }
        }
        self.ready.pop_front().map(Ok)
    }
}
