//! In: the word that names a source of pictures. Out: what it means, and the source, opened.
//! Frame and unit: none.

use super::format::RawFormat;
use super::picture::PictureSource;
use super::source::cell::CellCamera;
use super::source::pipe::Pipe;
use crate::fault::{Fault, Result};

/// A source of pictures by its name on the command line.
#[derive(Clone, Debug, PartialEq)]
pub enum CameraUri {
    /// `-`: raw frames on standard input; their format is stated beside it.
    Input,
    /// `cell://HOST:PORT?rate=FPS`: a cell's camera.
    Cell {
        /// `HOST:PORT`
        address: String,
        /// Pictures a second; 0: as the cell likes, negative: one by one.
        rate_hz: f64,
    },
}

/// What can be written, for messages.
const KNOWN: &str = "cell://HOST:PORT, - (with --raw)";

impl std::str::FromStr for CameraUri {
    type Err = String;
    fn from_str(s: &str) -> std::result::Result<CameraUri, String> {
        if s == "-" {
            return Ok(CameraUri::Input);
        }
        if let Some(rest) = s.strip_prefix("cell://") {
            let (address, query) = rest.split_once('?').unwrap_or((rest, ""));
            let [rate_hz] = options(query, ["rate"])?;
            if !address.contains(':') {
                return Err(format!("'{s}' names no port: cell://HOST:PORT"));
            }
            let rate_hz = rate_hz.map_or(Ok(0.0), |r| number("rate", r))?;
            return Ok(CameraUri::Cell { address: address.into(), rate_hz });
        }
        Err(format!("'{s}' names no camera; known are {KNOWN}"))
    }
}

/// The values of `KEY=VALUE&KEY=VALUE`, in the order of the keys; another key is refused.
fn options<'a, const N: usize>(query: &'a str, keys: [&str; N]) -> std::result::Result<[Option<&'a str>; N], String> {
    let mut out = [None; N];
    for pair in query.split('&').filter(|p| !p.is_empty()) {
        let (key, value) = pair.split_once('=').ok_or_else(|| format!("'{pair}' is not like KEY=VALUE"))?;
        let place = keys.iter().position(|k| *k == key);
        let place = place.ok_or_else(|| format!("unknown option '{key}': {}", keys.join(", ")))?;
        out[place] = Some(value);
    }
    Ok(out)
}

fn number(key: &str, text: &str) -> std::result::Result<f64, String> {
    text.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| format!("{key}={text} is no number"))
}

impl CameraUri {
    /// Opens the source; pictures come from now on. `raw` states what frames on a pipe are like.
    ///
    /// # Errors
    /// Nothing is there, it is in use, or it needs `raw`.
    pub fn open(&self, raw: Option<RawFormat>) -> Result<Box<dyn PictureSource>> {
        match self {
            CameraUri::Input => {
                let raw = raw.ok_or_else(|| {
                    Fault::usage("frames on standard input, and nobody says what they are like")
                        .next("state it: --raw 640x480:gray8")
                })?;
                Ok(Box::new(Pipe::new(raw, "standard input", std::io::stdin())?))
            }
            CameraUri::Cell { address, rate_hz } => Ok(Box::new(CellCamera::open(address, *rate_hz)?)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_name_sources_or_are_answered() {
        let cell = CameraUri::Cell { address: "cell3:5020".into(), rate_hz: 25.0 };
        assert_eq!("cell://cell3:5020?rate=25".parse(), Ok(cell));
        assert_eq!("-".parse(), Ok(CameraUri::Input));
        for (wrong, says) in [
            ("cell://cell3", "no port"),
            ("cell://c:1?fps=3", "unknown option 'fps': rate"),
            ("cell://c:1?rate=fast", "no number"),
            ("usb0", "names no camera"),
        ] {
            let said = wrong.parse::<CameraUri>().unwrap_err();
            assert!(said.contains(says), "{wrong}: {said}");
        }
    }
}
