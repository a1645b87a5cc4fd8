//! In: a cloud, in memory or on disk. Out: a binary PCD (Point Cloud Library), streamed.
//! Frame and unit: the cloud's frame, mm; the header's second comment states both. The fields are those of the PLY,
//! under the names that PCL viewers know.

use super::{CloudPoint, PointSource};
use crate::fault::{Fault, Result};
use std::io::{BufWriter, Write};
use std::path::Path;

/// Fields of a record with their types (F: float, U: unsigned), 4 bytes each; `record` writes them in this order.
const FIELDS: [(&str, &str); 9] = [
    ("x", "F"),
    ("y", "F"),
    ("z", "F"),
    ("intensity", "F"),
    ("sigma_mm", "F"),
    ("quality", "F"),
    ("shot", "U"),
    ("u", "F"),
    ("v", "F"),
];

/// [PCD file format, pointclouds.org, version 0.7]
fn header(count: u64, frame: &str) -> String {
    let of = |what: fn(&(&'static str, &'static str)) -> &'static str| FIELDS.each_ref().map(what).join(" ");
    format!(
        "# .PCD v.7 - Point Cloud Data file format\n# sheetlight cloud, {frame} frame, mm\n\
         VERSION .7\nFIELDS {}\nSIZE {}\nTYPE {}\nCOUNT {}\n\
         WIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\nDATA binary\n",
        of(|f| f.0),
        of(|_| "4"),
        of(|f| f.1),
        of(|_| "1")
    )
}

fn record(p: &CloudPoint) -> [u8; 36] {
    let [x, y, z] = p.position.to_array();
    let floats = [x, y, z, p.intensity, p.sigma_mm, p.quality].map(f32::to_bits);
    let words = floats.into_iter().chain([p.shot, p.u.to_bits(), p.v.to_bits()]);
    let mut bytes = [0; 36];
    bytes.chunks_exact_mut(4).zip(words).for_each(|(b, w)| b.copy_from_slice(&w.to_le_bytes()));
    bytes
}

/// Writes `path` under a temporary name and renames it when it is complete. `frame` is the points' frame.
pub fn write_pcd(path: &Path, source: &(impl PointSource + ?Sized), count: u64, frame: &str) -> Result<()> {
    let file = crate::files::Aside::create(path)?;
    let mut out = BufWriter::with_capacity(1 << 20, file.file());
    let mut written = out.write_all(header(count, frame).as_bytes());
    source.for_each_chunk(&mut |chunk| {
        for p in chunk {
            if written.is_ok() {
                written = out.write_all(&record(p));
            }
        }
    })?;
    written.and_then(|()| out.flush()).map_err(|e| Fault::write(path, e))?;
    drop(out);
    file.keep()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pcd_holds_header_and_records() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.pcd");
        let points: Vec<CloudPoint> = (0..5)
            .map(|i| CloudPoint { position: [i as f32, 2.5, -1.0].into(), shot: 7, v: 3.25, ..Default::default() })
            .collect();
        write_pcd(&path, &points, 5, "camera").unwrap();
        let reader = pcd_rs::DynReader::open(&path).unwrap();
        assert_eq!(reader.map(|r| r.unwrap().0.len()).collect::<Vec<_>>(), [9; 5]);
        let bytes = std::fs::read(&path).unwrap();
        let end = bytes.windows(12).position(|w| w == b"DATA binary\n").unwrap() + 12;
        let header = String::from_utf8_lossy(&bytes[..end]);
        assert!(
            header.contains("POINTS 5") && header.contains("FIELDS x y z intensity sigma_mm quality shot u v"),
            "{header}"
        );
        assert!(header.contains("\n# sheetlight cloud, camera frame, mm\n"), "{header}");
        assert!(header.contains("SIZE 4 4 4 4 4 4 4 4 4\nTYPE F F F F F F U F F\n"), "{header}");
        assert_eq!(bytes.len() - end, 5 * 36);
        let third = &bytes[end + 2 * 36..];
        let float = |i: usize| f32::from_le_bytes(third[4 * i..4 * i + 4].try_into().unwrap());
        assert_eq!((float(0), float(1), float(2), float(8)), (2.0, 2.5, -1.0, 3.25));
        assert_eq!(u32::from_le_bytes(third[24..28].try_into().unwrap()), 7);
    }
}
