//! In: pose files and station.toml with numbers, units, columns and signs that cannot be. Out: a fault that names
//! them, or the poses that they hold.
//! Frame and unit: as each file says.

use crate::table::{Case, Good, Want, Want::Says, case, check};
use sheetlight::recording::load_poses;
use sheetlight::station::Settings;

fn csv(name: &str, want: Want, text: String) -> Case {
    case(name, want, move || {
        let dir = tempfile::tempdir().expect("a folder");
        let path = dir.path().join("poses.csv");
        std::fs::write(&path, text).expect("a file");
        load_poses(&path)
    })
}

/// Three poses of a convention with this header, the second row as given.
fn with(convention: &str, header: &str, row: &str) -> String {
    format!("# convention: {convention}\n{header}\n0,400,0,300,170,10,20\n{row}\n2,410,5,300,-170,12,21\n")
}

fn denso(row: &str) -> String {
    with("denso", "frame,x,y,z,rx,ry,rz", row)
}

#[test]
fn numbers() {
    let of = |angle: &str| denso(&format!("1,400,0,300,{angle},0,0"));
    check(vec![
        csv("good poses", Good, of("180")),
        csv("an angle of 1e10", Says(&["pose 1", "10000000000", "at most 3600"]), of("1e10")),
        csv("an angle of -1e160", Says(&["-1e160", "at most 3600"]), of("-1e160")),
        csv("an angle of 1e308", Says(&["1e308", "at most 3600"]), of("1e308")),
        csv("an angle of nan", Says(&["not finite"]), of("nan")),
        csv("a length of inf", Says(&["not finite"]), denso("1,inf,0,300,0,0,0")),
        csv("a length of 400 m", Says(&["400000 mm", "100000"]), denso("1,4e5,0,300,0,0,0")),
        csv("a length of 4 km", Says(&["4e6", "slipped"]), denso("1,4e6,0,300,0,0,0")),
        csv("a pose that is missing", Says(&["pose 1 is numbered 2"]), denso("")),
        csv("a pose twice", Says(&["pose 1 is numbered 0"]), denso("0,400,0,300,170,10,20")),
        csv("a row cut off", Says(&["4 columns"]), denso("1,400,0,30")),
        csv("no rows", Good, "# convention: denso\nframe,x,y,z,rx,ry,rz\n".into()),
    ]);
}

#[test]
fn units_and_columns() {
    let rows = |convention: &str, header: &str, rows: [&str; 3]| {
        format!("# convention: {convention}\n{header}\n{}\n", rows.join("\n"))
    };
    let plain = "frame,x,y,z,rx,ry,rz";
    let metres = ["0,0.4,0,0.3,170,10,20", "1,0.41,0,0.3,170,10,20", "2,0.42,0,0.3,170,10,20"];
    let radians = ["0,400,0,300,3.1,0.1,0.2", "1,410,0,300,3,0.1,0.2", "2,420,0,300,3,0.1,0.2"];
    let degrees = ["0,0.4,0,0.3,170,10,20", "1,0.41,0,0.3,170,10,20", "2,0.42,0,0.3,170,10,20"];
    let stated = "frame,X_mm,Y_mm,Z_mm,RX_deg,RY_deg,RZ_deg";
    check(vec![
        csv("metres under denso", Says(&["look like metres"]), rows("denso", plain, metres)),
        csv("metres that are stated as mm", Good, rows("denso", stated, metres)),
        csv("radians under denso", Says(&["radians, denso has degrees"]), rows("denso", plain, radians)),
        csv("small degrees that are stated", Good, rows("denso", stated, radians)),
        csv("degrees under ur", Says(&["above a turn in radians"]), rows("ur", plain, degrees)),
        csv("columns in another order", Says(&["the columns are"]), rows("denso", "frame,rx,ry,rz,x,y,z", metres)),
        csv("X_m under denso", Says(&["column 2 is 'X_m'"]), rows("denso", "frame,X_m,Y_m,Z_m,RX,RY,RZ", metres)),
        csv(
            "A_rad under kuka",
            Says(&["'A_rad', kuka has it in deg"]),
            rows("kuka", "frame,X,Y,Z,A_rad,B_rad,C_rad", radians),
        ),
        csv("semicolons", Says(&["semicolons"]), with("denso", "frame;x;y;z;rx;ry;rz", "1;1,5;2;3;4;5;6")),
        csv("decimal commas", Says(&["13 columns"]), denso("1,400,5,0,5,300,5,170,5,10,5,20,5")),
        csv("a byte order mark", Good, format!("\u{feff}{}", denso("1,400,0,300,170,10,20"))),
        csv(
            "no header",
            Says(&["numbers instead of column names"]),
            "# convention: \
            denso\n0,400,0,300,170,10,20\n"
                .into(),
        ),
        csv("no convention", Says(&["without a convention"]), "frame,x,y,z,rx,ry,rz\n0,400,0,300,170,10,20\n".into()),
        csv(
            "a quaternion of length 1.41",
            Says(&["length 1.4142"]),
            "# convention: quaternion\nframe,x,y,z,qw,qx,qy,qz\n0,400,0,300,1,1,0,0\n".into(),
        ),
    ]);
}

#[test]
fn stations() {
    let toml = |name: &str, want: Want, text: &str| {
        let bytes = text.as_bytes().to_vec();
        case(name, want, move || {
            let dir = tempfile::tempdir().expect("a folder");
            std::fs::write(dir.path().join("station.toml"), bytes).expect("a file");
            Settings::load(dir.path())
        })
    };
    let volume = |near: &str, far: &str| format!("[working_volume]\nnear_mm = {near}\nfar_mm = {far}\n");
    check(vec![
        toml("a good one", Good, &volume("60", "320")),
        toml("a byte order mark", Good, &format!("\u{feff}{}", volume("60", "320"))),
        toml("a decimal comma", Says(&["line 2", "decimal comma"]), &volume("60,5", "320")),
        toml("a decimal comma in quotes", Says(&["decimal comma"]), &volume("'60,5'", "320")),
        toml("a semicolon", Says(&["line 1", "semicolon"]), "name = 'a';\n"),
        toml("a unit", Says(&["unit beside a number"]), &volume("60 mm", "320")),
        toml("a colon", Says(&["colon"]), "name: a\n"),
        toml("metres", Says(&["looks like metres"]), &volume("0.06", "0.32")),
        toml("micrometres", Says(&["looks like micrometres"]), &volume("60000", "320000")),
        toml("a tolerance in metres", Says(&["looks like metres"]), "tolerance_mm = 0.0001\n"),
        toml("swapped", Says(&["near_mm = 320", "swapped"]), &volume("320", "60")),
        toml("nan", Says(&["NaN"]), &volume("nan", "320")),
        toml("a misspelt key", Says(&["near_m"]), "[working_volume]\nnear_m = 60\nfar_mm = 320\n"),
        toml("a size of 1e300", Says(&[]), "[extraction.threshold]\nsize = 1e300\n"),
    ]);
}
