//! In: a cloud, in memory or on disk. Out: a binary PCD (Point Cloud Library), streamed.
//! Frame and unit: base frame, mm; the PLY's fields under the names that PCL viewers know.

use super::PointSource;
use crate::fault::{Fault, Result};
use pcd_rs::{DataKind, PcdSerialize, Writer, WriterInit};
use std::io::BufWriter;
use std::path::Path;

#[derive(PcdSerialize)]
struct Record {
    x: f32,
    y: f32,
    z: f32,
    intensity: f32,
    sigma_mm: f32,
    quality: f32,
    shot: u32,
    u: f32,
    v: f32,
}

/// Writes `path` under a temporary name and renames it when it is complete.
pub fn write_pcd(path: &Path, source: &(impl PointSource + ?Sized), count: u64) -> Result<()> {
    let file = crate::files::Aside::create(path)?;
    let failed = |e: pcd_rs::Error| Fault::write(path, std::io::Error::other(e.to_string()));
    let init = WriterInit {
        width: count,
        height: 1,
        viewpoint: Default::default(),
        data_kind: DataKind::Binary,
        schema: None,
        version: None,
    };
    let handle = file.file().try_clone().map_err(|e| Fault::write(path, e))?;
    let mut writer: Writer<Record, _> =
        init.build_from_writer(BufWriter::with_capacity(1 << 20, handle)).map_err(failed)?;
    let mut wrong = None;
    source.for_each_chunk(&mut |chunk| {
        for p in chunk {
            let [x, y, z] = p.position;
            let record = Record {
                x,
                y,
                z,
                intensity: p.intensity,
                sigma_mm: p.sigma_mm,
                quality: p.quality,
                shot: p.shot,
                u: p.u,
                v: p.v,
            };
            if wrong.is_none() {
                wrong = writer.push(&record).err();
            }
        }
    })?;
    if let Some(e) = wrong {
        return Err(failed(e));
    }
    writer.finish().map_err(failed)?;
    file.keep()
}

#[cfg(test)]
mod tests {
    use super::super::CloudPoint;
    use super::*;

    #[test]
    fn a_pcd_holds_header_and_records() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.pcd");
        let points: Vec<CloudPoint> = (0..5)
            .map(|i| CloudPoint { position: [i as f32, 2.5, -1.0], shot: 7, v: 3.25, ..Default::default() })
            .collect();
        write_pcd(&path, &points, 5).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let end = bytes.windows(12).position(|w| w == b"DATA binary\n").unwrap() + 12;
        let header = String::from_utf8_lossy(&bytes[..end]);
        assert!(
            header.contains("POINTS 5") && header.contains("FIELDS x y z intensity sigma_mm quality shot u v"),
            "{header}"
        );
        assert_eq!(bytes.len() - end, 5 * 36);
        let third = &bytes[end + 2 * 36..];
        let float = |i: usize| f32::from_le_bytes(third[4 * i..4 * i + 4].try_into().unwrap());
        assert_eq!((float(0), float(1), float(2), float(8)), (2.0, 2.5, -1.0, 3.25));
        assert_eq!(u32::from_le_bytes(third[24..28].try_into().unwrap()), 7);
    }
}
