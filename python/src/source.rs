//! Shots that Python code has: arrays with poses, or an iterator that gives them one by one.

use crate::arrays::{format_of, picture};
use crate::fault::raised_by;
use crate::poses::pose;
use crate::progress::Progress;
use pyo3::prelude::*;
use pyo3::types::{PyIterator, PyTuple};
use sheetlight::capture::Format;
use sheetlight::fault::Fault;
use sheetlight::geometry::{Base, Flange, Rigid};
use sheetlight::raster::Image;
use sheetlight::recording::Stand;
use sheetlight::scan::{BadShot, Shot, Source};

type Posed = (Image, Rigid<Base, Flange>);

/// Pictures and poses that an iterator gives, or pictures that an iterator gives for poses that are known.
pub struct PythonSource {
    items: Py<PyIterator>,
    poses: Option<Vec<Rigid<Base, Flange>>>,
    bits: Option<u8>,
    format: Format,
    /// Read ahead, because the format of all is the first one's.
    first: Option<Posed>,
    count: u32,
    ended: bool,
    progress: Progress,
}

impl PythonSource {
    /// Takes the first picture. What Python raises while the scan runs is kept by `progress`.
    pub fn new(
        object: &Bound<'_, PyAny>,
        poses: Option<Vec<Rigid<Base, Flange>>>,
        bits: Option<u8>,
        progress: Progress,
    ) -> PyResult<PythonSource> {
        let items = object.try_iter().map_err(|error| {
            let is = crate::arrays::type_name(object);
            raised_by(error, |_| {
                Fault::usage(format!("what is to be scanned is a {is}"))
                    .cause("it is neither a recording nor a row of pictures")
                    .next("give a Recording or its folder, N x rows x columns with poses, or pairs (picture, pose)")
            })
        })?;
        let format = Format { width: 0, height: 0, bits: 0 };
        let items = items.unbind();
        let mut source = PythonSource { items, poses, bits, format, first: None, count: 0, ended: false, progress };
        let first = source.take(object.py())?;
        let Some(first) = first else {
            return Err(crate::fault::raised(
                Fault::input("there is no picture to scan")
                    .cause("an empty list, or an iterator that was used up")
                    .next("give at least one picture; an iterator gives its pictures only once"),
            ));
        };
        source.format = format_of(&first.0);
        source.first = Some(first);
        Ok(source)
    }

    /// The next picture with its pose; None at the end.
    fn take(&mut self, py: Python<'_>) -> PyResult<Option<Posed>> {
        let index = self.count as usize;
        let item = self.items.bind(py).clone().next().transpose().map_err(|error| {
            let kind = error.get_type(py).name().map_or_else(|_| String::new(), |n| n.to_string());
            raised_by(error, |said| {
                Fault::input(format!("the pictures ended at picture {index}: {said}"))
                    .cause(format!("the code that gives them raised a {kind}"))
                    .next("see the exception that this one names as its cause")
            })
        })?;
        let Some(item) = item else { return self.end(index).map(|()| None) };
        let named = format!("picture {index}");
        let posed = match &self.poses {
            Some(poses) => {
                let Some(at) = poses.get(index) else { return Err(self.uneven(index + 1, "more than")) };
                (picture(&item, self.bits, &named)?, *at)
            }
            None => {
                let pair = item.cast::<PyTuple>().ok().filter(|t| t.len() == 2).ok_or_else(|| {
                    let is = crate::arrays::type_name(&item);
                    crate::fault::raised(
                        Fault::input(format!("{named} came as a {is}, a pair (picture, pose) is needed"))
                            .cause("pictures alone, and no poses beside them")
                            .next("give pairs, or the poses as poses=: one 4 x 4 matrix in mm a picture"),
                    )
                })?;
                let at = pose(&pair.get_item(1)?, &format!("pose {index}"))?;
                (picture(&pair.get_item(0)?, self.bits, &named)?, at)
            }
        };
        let is = format_of(&posed.0);
        if index > 0 && is != self.format {
            let words = |f: Format| format!("{}x{} with {} bits", f.width, f.height, f.bits);
            return Err(crate::fault::raised(
                Fault::input(format!("{named} is {}, the first one is {}", words(is), words(self.format)))
                    .cause("another camera, or its region was changed meanwhile")
                    .next("scan pictures of one size and depth together"),
            ));
        }
        self.count += 1;
        Ok(Some(posed))
    }

    /// The pictures are through: are the poses?
    fn end(&self, came: usize) -> PyResult<()> {
        match &self.poses {
            Some(poses) if poses.len() != came => Err(self.uneven(came, "only")),
            _ => Ok(()),
        }
    }

    fn uneven(&self, came: usize, how: &str) -> PyErr {
        let poses = self.poses.as_ref().map_or(0, Vec::len);
        let came = if how == "only" { came } else { came - 1 };
        crate::fault::raised(
            Fault::input(format!("there are {how} {came} pictures and {poses} poses"))
                .cause("a picture or a pose was lost, so nobody knows which belong together")
                .next("give one pose a picture, in the same order"),
        )
    }
}

impl Source for PythonSource {
    fn format(&self) -> Format {
        self.format
    }
    fn remaining(&self) -> Option<usize> {
        self.poses.as_ref().map(|p| p.len() - (self.count as usize - usize::from(self.first.is_some())))
    }
    fn next(&mut self) -> Option<Result<Shot, BadShot>> {
        if self.ended {
            return None;
        }
        let taken = match self.first.take() {
            Some(first) => Ok(Some(first)),
            None => Python::attach(|py| self.take(py)),
        };
        let index = self.count.saturating_sub(1);
        let name = format!("picture {index}");
        match taken {
            Ok(Some((image, at))) => {
                let stand = Stand::Robot(at);
                Some(Ok(Shot { index, name, image, stand, slip: None, here_ns: None }))
            }
            Ok(None) => {
                self.ended = true;
                None
            }
            Err(error) => {
                self.ended = true;
                self.progress.keep(error);
                let fault = Fault::input(format!("{name}: the pictures ended with an exception"));
                Some(Err(BadShot { index, name, fault, last: true }))
            }
        }
    }
}
