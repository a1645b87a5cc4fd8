//! Clouds of other programs: fields that are not needed, kinds of numbers, the sensor's place, points without
//! measurement.

use sheetlight::fault::Fault;
use sheetlight::scan::{Lines, Raw, Stated, lines, read_foreign};

/// Points on a lattice with heights that no two share.
fn points() -> Vec<[f32; 3]> {
    (0..1200).map(|i| [0.5 * (i % 40) as f32, 0.5 * (i / 40) as f32, 5.0 + (i * 7919 % 1201) as f32 * 1e-3]).collect()
}

fn stated(missing: Option<Option<f64>>) -> Stated {
    Stated { unit_mm: Some(1.0), spacing_mm: Some([0.5, 0.5]), missing, ..Stated::default() }
}

fn made(bytes: &[u8], stated: &Stated) -> Result<Lines, Fault> {
    lines(&read_foreign(bytes)?, None, stated)
}

/// A PCD of x, y, z and one more field, in the given layout; `extra` are its bytes.
fn pcd(
    points: &[[f32; 3]],
    (name, size, kind, count): (&str, usize, &str, usize),
    viewpoint: &str,
    data: &str,
) -> Vec<u8> {
    let head = format!(
        "# .PCD v0.7\nVERSION 0.7\nFIELDS {name} x y z\nSIZE {size} 4 4 4\nTYPE {kind} f F F\nCOUNT {count} 1 1 \
         1\nWIDTH 40\n\
         HEIGHT {}\nVIEWPOINT {viewpoint}\nPOINTS {}\nDATA {data}\n",
        points.len() / 40,
        points.len()
    );
    let extra = vec![7u8; size * count];
    let record = |p: &[f32; 3]| [extra.clone(), p.iter().flat_map(|v| v.to_le_bytes()).collect()].concat();
    let words = |p: &[f32; 3]| format!("{}{} {} {}\n", "7 ".repeat(count), p[0], p[1], p[2]).into_bytes();
    let body: Vec<u8> = points.iter().flat_map(|p| if data == "ascii" { words(p) } else { record(p) }).collect();
    [head.into_bytes(), body].concat()
}

const HERE: &str = "0 0 0 1 0 0 0";

#[test]
fn fields_that_are_not_needed_need_not_be_understood() {
    let all = points();
    for field in [
        ("t", 8, "U", 1),
        ("t", 8, "I", 1),
        ("t", 8, "u", 1),
        ("t", 8, "F", 1),
        ("ring", 2, "u", 1),
        ("label", 1, "i", 1),
        ("fpfh", 4, "F", 33),
        ("_", 1, "U", 13),
        ("odd", 3, "U", 1),
        ("long", 16, "F", 1),
    ] {
        for data in ["binary", "ascii"] {
            let made = made(&pcd(&all, field, HERE, data), &stated(None)).unwrap_or_else(|e| panic!("{field:?}: {e}"));
            let same = made.points.iter().zip(&all).all(|(p, q)| p.position.to_array() == *q);
            assert!(same && made.points.len() == all.len(), "{field:?} {data}");
        }
    }
    let strange = made(&pcd(&all, ("intensity", 3, "U", 1), HERE, "binary"), &stated(None)).unwrap_err();
    assert!(strange.what.contains("intensity"), "{strange}");
}

#[test]
fn the_place_of_the_sensor_must_be_the_origin() {
    let all = points();
    let file = |viewpoint: &str| pcd(&all, ("t", 8, "U", 1), viewpoint, "binary");
    for here in [HERE, "0 0 0 -1 0 0 0", "0.0 0.0 0.0 1.0 0.0 0.0 0.0", "0 0 0 0 0 0 0"] {
        assert!(read_foreign(&file(here)).is_ok(), "{here}");
    }
    for there in [
        "0 0 5 1 0 0 0",
        "1e-3 0 0 1 0 0 0",
        "0 0 0 0 1 0 0",
        "0 0 0 0.7071 0 0 0.7071",
        "0 0 0 1",
        "a b c 1 0 0 0",
        "",
    ] {
        let fault = read_foreign(&file(there)).unwrap_err();
        assert!(fault.what.contains("VIEWPOINT") && !fault.next.is_empty(), "{there}: {fault}");
    }
}

#[test]
fn lists_and_other_elements_of_a_ply_are_passed_over() {
    let all = points();
    let n = all.len();
    let bytes = |big: bool, v: &[f32]| -> Vec<u8> {
        let xyz = v.iter().flat_map(|v| if big { v.to_be_bytes() } else { v.to_le_bytes() });
        xyz.chain([7; 8]).collect()
    };
    let length = |big: bool, v: u16| if big { v.to_be_bytes() } else { v.to_le_bytes() };
    for (big, name) in [(false, "binary_little_endian"), (true, "binary_big_endian")] {
        let xyz = "property float x\nproperty FLOAT32 y\nproperty Float z\nproperty uint64 t\n";
        let head = |before: &str, after: &str| {
            format!(
                "ply\nformat {name} 1.0\ncomment this end_header is none\nobj_info num_cols 40\n{before}element \
                 vertex {n}\n{xyz}\
                 {after}end_header\n"
            )
        };
        let plain: Vec<u8> = all.iter().flat_map(|p| bytes(big, p)).collect();
        // Lists of different lengths in each vertex, of faces before the vertices, and of both.
        let listed = |k: usize| [&length(big, (k % 3) as u16)[..], &vec![9; 2 * (k % 3)]].concat();
        let inside: Vec<u8> = all.iter().enumerate().flat_map(|(k, p)| [bytes(big, p), listed(k)].concat()).collect();
        let faces: Vec<u8> = (0..5).flat_map(listed).collect();
        let list = "property list ushort ushort seen\n";
        let before = format!("element face 5\n{list}");
        for (k, file) in [
            [head("", "").into_bytes(), plain.clone()].concat(),
            [head("", list).into_bytes(), inside.clone()].concat(),
            [head(&before, "").into_bytes(), faces.clone(), plain].concat(),
            [head(&before, list).into_bytes(), faces, inside].concat(),
        ]
        .iter()
        .enumerate()
        {
            let Raw::Points { points, .. } = read_foreign(file).unwrap_or_else(|e| panic!("{name} {k}: {e}")) else {
                panic!()
            };
            assert!(points.iter().zip(&all).all(|(p, q)| *p == q.map(f64::from)) && points.len() == n, "{name} {k}");
            assert!(read_foreign(&file[..file.len() - 1]).is_err());
        }
    }
    let text = "ply\nformat ascii 1.0\nelement vertex 2\nproperty list uchar int seen\nproperty double X\nproperty \
                double Y\n\
                property int64 Z\nend_header\n2 8 9 1 2 3\n0 4 5 6\n";
    let Raw::Points { points, .. } = read_foreign(text.as_bytes()).unwrap() else { panic!() };
    assert_eq!(points, [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
}

#[test]
fn points_that_were_not_measured_are_dropped_where_stated_and_named_where_not() {
    for (stand_in, whole_point) in [
        (0.0f32, true),
        (0.0, false),
        (-99.9999, false),
        (-9999.0, true),
        (-32_768.0, false),
        (999.999, false),
        (1e4, true),
    ] {
        let mut all = points();
        all.iter_mut().step_by(20).for_each(|p| *p = if whole_point { [stand_in; 3] } else { [p[0], p[1], stand_in] });
        for data in ["ascii", "binary"] {
            let file = pcd(&all, ("t", 8, "U", 1), HERE, data);
            let unsaid = made(&file, &stated(None)).unwrap();
            let said = unsaid.notes.join("; ");
            assert_eq!(unsaid.points.len(), 1200);
            assert!(said.contains("60 of 1200") && said.contains(&format!("--missing {stand_in}")), "{said}");
            let level: f64 = stand_in.to_string().parse().unwrap();
            let dropped = made(&file, &stated(Some(Some(level)))).unwrap();
            assert_eq!(dropped.points.len(), 1140, "{stand_in}");
            assert!(!dropped.notes.join("; ").contains("exactly the height"));
            // Every number is a height: the person says so.
            let kept = made(&file, &stated(Some(None))).unwrap();
            assert!(kept.points.len() == 1200 && !kept.notes.join("; ").contains("exactly the height"));
        }
    }
    // Right clouds are not suspected, and a level that no point has is named.
    let plain = made(&pcd(&points(), ("t", 8, "U", 1), HERE, "binary"), &stated(Some(Some(-1.0)))).unwrap();
    let said = plain.notes.join("; ");
    assert!(!said.contains("exactly the height") && said.contains("no point has the z -1"), "{said}");
    // NaN and infinity are missing without a word.
    let mut all = points();
    (all[3][2], all[4][0], all[5][2]) = (f32::NAN, f32::NEG_INFINITY, f32::INFINITY);
    assert_eq!(made(&pcd(&all, ("t", 8, "U", 1), HERE, "binary"), &stated(None)).unwrap().points.len(), 1197);
}

#[test]
fn a_unit_in_a_comment_that_differs_is_named() {
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let rows: String = points().iter().map(|p| format!("{} {} {}\n", p[0], p[1], p[2])).collect();
    let ply = |comment: &str| {
        format!("ply\nformat ascii 1.0\ncomment {comment}\nelement vertex 1200\n{xyz}end_header\n{rows}").into_bytes()
    };
    let pcd = |comment: &str| {
        let plain = pcd(&points(), ("t", 8, "U", 1), HERE, "ascii");
        [format!("# {comment}\n").into_bytes(), plain].concat()
    };
    for (comment, mm) in [
        ("units: m", Some("1000")),
        ("unit = inch", Some("25.4")),
        ("units: mm", None),
        ("sheetlight cloud, base frame, mm", None),
        ("made with unity", None),
    ] {
        for file in [ply(comment), pcd(comment)] {
            let said = made(&file, &stated(None)).unwrap().notes.join("; ");
            assert_eq!(said.contains("as stated"), mm.is_some(), "{comment}: {said}");
            assert!(mm.is_none_or(|mm| said.contains(&format!("--unit-mm {mm}"))), "{comment}: {said}");
        }
    }
    let stated = Stated { unit_mm: Some(1000.0), ..stated(None) };
    let own = pcd("sheetlight cloud, map frame, mm");
    assert!(made(&own, &stated).unwrap().notes.join("; ").contains("which is --unit-mm 1;"));
}

#[test]
fn more_points_than_the_header_counts_are_refused() {
    let all = points();
    for data in ["binary", "ascii"] {
        let whole = pcd(&all, ("t", 8, "U", 1), HERE, data);
        let text = String::from_utf8_lossy(&whole[..whole.len().min(400)]).into_owned();
        let head = text.split_inclusive('\n').take_while(|l| !l.starts_with("DATA")).collect::<String>().len();
        let less = String::from_utf8_lossy(&whole[..head]).replace("HEIGHT 30", "HEIGHT 25");
        let less = less.replace("POINTS 1200", "POINTS 1000");
        let fault = read_foreign(&[less.as_bytes(), &whole[head..]].concat()).unwrap_err();
        assert!(fault.what.contains("1200 points or more, its header counts 1000"), "{data}: {fault}");
        // An empty line behind the last point is not a further point.
        assert!(read_foreign(&[&whole[..], b"\n"].concat()).is_ok(), "{data}");
    }
    let ply = |kind: &str, count: usize, xyz: &str, after: &str, body: &[u8]| {
        let head = format!("ply\nformat {kind} 1.0\nelement vertex {count}\n{xyz}{after}end_header\n");
        read_foreign(&[head.as_bytes(), body].concat()).map(drop).map_err(|fault| fault.what)
    };
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let faces = "element face 2\nproperty list uchar int vertex_indices\n";
    let text = "0 0 1\n1 0 1\n0 1 1\n1 1 1\n";
    let list = "3 0 1 2\n3 1 2 3\n";
    assert_eq!(ply("ascii", 4, xyz, "", text.as_bytes()), Ok(()));
    assert_eq!(ply("ascii", 4, xyz, faces, format!("{text}{list}").as_bytes()), Ok(()));
    for (count, after, body) in [(3, "", text.to_owned()), (2, faces, format!("{text}{list}"))] {
        let said = ply("ascii", count, xyz, after, body.as_bytes()).unwrap_err();
        assert!(said.contains("4 points or more"), "{said}");
    }
    let binary: Vec<u8> =
        [0.0f32, 0.0, 1.0, 1.0, 0.0, 1.0, 0.0, 1.0, 1.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let indices = [&[3u8][..], &[0; 12], &[3], &[0; 12]].concat();
    assert_eq!(ply("binary_little_endian", 3, xyz, faces, &[&binary[..], &indices].concat()), Ok(()));
    assert!(ply("binary_little_endian", 2, xyz, "", &binary).unwrap_err().contains("3 points or more"));
    // Which of two fields of one name is meant is not known.
    let twice = format!("{xyz}property float z\n");
    assert!(ply("ascii", 1, &twice, "", b"0 0 1 2\n").unwrap_err().contains("2 of its fields are called z"));
    let file = String::from_utf8(pcd(&all, ("t", 8, "U", 1), HERE, "ascii")).unwrap();
    let fault = read_foreign(file.replace("COUNT 1 1 1 1", "COUNT 1 2 1 1").as_bytes()).unwrap_err();
    assert!(fault.what.contains("field x has 2 numbers"), "{fault}");
}

#[test]
fn files_of_other_formats_are_named_with_those_that_are_read() {
    for (bytes, name) in [
        (&b"Pf\n2 2\n-1.0\n\0\0\0\0"[..], "a PFM picture"),
        (b"x,y,z\n0.5,1,2\n", "a table of numbers"),
        (b"0.5 1 2e-3\n", "a table of numbers"),
        (b"\x93NUMPY\x01\0", "NPY"),
        (b"LASF\0\0", "a LAS or LAZ cloud"),
        (b"PK\x03\x04", "a ZIP archive"),
    ] {
        let fault = read_foreign(bytes).unwrap_err();
        assert!(fault.what.contains(name) && fault.cause.contains("clouds as PLY and PCD"), "{fault}");
        assert!(!fault.to_string().contains("--skip-bad"), "{fault}");
    }
    assert!(read_foreign(b"P2\n2 1\n9\n3 4\n").is_ok());
    let webp = sheetlight::raster::decode(b"RIFF\x20\0\0\0WEBPVP8L", Default::default(), 8).unwrap_err();
    assert!(webp.what.contains("it is a WebP picture") && !webp.to_string().contains("--skip-bad"), "{webp}");
    // The light's own size is named.
    let light = read_foreign(b"P2\n3 1\n9\n3 4 5\n").unwrap();
    let heights = read_foreign(b"P2\n2 1\n9\n3 4\n").unwrap();
    let fault = lines(&heights, Some(&light), &stated(Some(None))).unwrap_err();
    assert!(fault.what.contains("(--light) is 3x1, the heights are 2x1"), "{fault}");
}

#[test]
fn options_that_do_nothing_to_a_cloud_are_refused() {
    let file = pcd(&points(), ("t", 8, "U", 1), HERE, "binary");
    let raw = read_foreign(&file).unwrap();
    for (stated, light, word) in [
        (Stated { rows_up: true, ..stated(None) }, None, "--rows-up"),
        (Stated { offset_mm: 1.0, ..stated(None) }, None, "--offset-mm"),
        (stated(None), Some(&raw), "--light"),
    ] {
        let fault = lines(&raw, light, &stated).unwrap_err();
        assert!(fault.what.contains(word) && fault.exit_code() == 2, "{fault}");
    }
    assert!(sheetlight::scan::read_foreign_page(&file, Some(1)).unwrap_err().next.contains("--page"));
    assert!(made(&file, &stated(None)).unwrap().notes.join("; ").contains("--spacing-mm was not needed"));
}
