//! In: a finished scan folder, and its errors where the truth is known. Out: index.html, one page that
//! carries its pictures and points inside and loads nothing from anywhere.
//! Frame and unit: points of the view in the grid frame, mm.

use super::figures::{HISTOGRAM_STEP, Judged};
use super::parts::FoundPart;
use crate::calibrate::report::escape;
use crate::fault::Result;
use crate::geometry::Vec3;
use crate::scan::{CloudFile, HeightMap, PointSource};
use crate::simulate::CloudErrors;
use crate::station::scan::report::{ScanReport, load_report};
use base64::prelude::{BASE64_STANDARD, Engine};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Points in the 3-D view; every k-th of the cloud.
const VIEW_POINTS: u64 = 120_000;
/// Bytes of a picture on the page.
const MOST_PICTURE: u64 = 256 << 20;

/// Writes `index.html` beside the scan's other files.
pub fn save(scan: &Path, judged: Option<&Judged>, found: &[FoundPart]) -> Result<PathBuf> {
    let report = load_report(scan)?;
    let map = HeightMap::load(scan).ok();
    let mut body = String::new();
    head(&mut body, &report, judged);
    if let Some(map) = &map {
        let _ = write!(
            body,
            "<section><h2>Height map</h2>{}",
            picture(
                scan,
                "height_picture.png",
                "Height above the scan's best plane; dark cells were not measured and stay missing."
            )?
        );
        view(&mut body, scan, map)?;
        body.push_str("</section>");
    }
    if let Some(j) = judged {
        errors(&mut body, scan, j)?;
    }
    parts(&mut body, scan, found)?;
    shots(&mut body, scan)?;
    peaks(&mut body, &report);
    if map.is_some() {
        body.push_str("<section><h2>Companion maps</h2><div class=\"pair\">");
        for (name, caption) in [
            ("intensity_picture.png", "Stripe amplitude"),
            ("sigma_picture.png", "Standard deviation of the height that each cell states"),
            ("coverage_picture.png", "Points per cell"),
        ] {
            body.push_str(&picture(scan, name, caption)?);
        }
        body.push_str("</div></section>");
    }
    machine(&mut body, &report);
    let title = format!("Scan of {}", escape(&report.recording));
    let page = format!(
        "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
         <title>{title}</title><style>{STYLE}</style></head><body><main>{body}<footer>{} · {}</footer></main></body></html>\n",
        escape(&report.program),
        escape(&report.created)
    );
    let path = scan.join("index.html");
    crate::files::write(&path, page.as_bytes())?;
    Ok(path)
}

fn head(body: &mut String, r: &ScanReport, judged: Option<&Judged>) {
    let _ = write!(
        body,
        "<header><h1>{}</h1><p>Sheet-of-light scan, points in the robot's base frame</p></header><div class=\"cards\">",
        escape(&r.recording)
    );
    let mut card = |value: String, what: &str| {
        let _ = write!(body, "<div class=\"card\"><b>{}</b><span>{}</span></div>", escape(&value), escape(what));
    };
    card(thousands(r.points), "points");
    card(r.shots.to_string(), &format!("shots of {}×{}, full resolution", r.image.width, r.image.height));
    if let Some(sigma) = r.median_sigma_mm {
        card(format!("{sigma:.3} mm"), "standard deviation of a point (median, as stated by the scan)");
    }
    if let Some(j) = judged {
        card(format!("{:.3} mm", j.cloud.median_mm), "true distance from the surface (median)");
        card(format!("{:.2} %", 100.0 * j.cloud.outliers_share), "points beyond 1 mm");
    }
    if let Some(h) = &r.height_map {
        card(format!("{:.1} %", 100.0 * h.coverage), "of the height map's cells measured");
    }
    card(format!("{:.0} shots/s", r.shots_per_second), &r.ran_on);
    body.push_str("</div>");
}

fn errors(body: &mut String, scan: &Path, j: &Judged) -> Result<()> {
    body.push_str("<section><h2>Errors against the truth</h2><p>The station was simulated, so the exact surface is known: this is the distance of every point from it, not a residual of a fit.</p><div class=\"pair\">");
    let top = j.histogram.iter().copied().max().unwrap_or(1).max(1) as f64;
    let mut bars = String::new();
    for (i, &n) in j.histogram.iter().enumerate() {
        let height = 150.0 * n as f64 / top;
        let _ = write!(
            bars,
            "<rect x=\"{}\" y=\"{:.1}\" width=\"17\" height=\"{height:.1}\"/>",
            30 + 20 * i,
            160.0 - height
        );
    }
    for i in (0..j.histogram.len()).step_by(5) {
        let _ = write!(bars, "<text x=\"{}\" y=\"178\">{:.2}</text>", 30 + 20 * i, i as f64 * HISTOGRAM_STEP);
    }
    let _ = write!(
        body,
        "<figure><svg viewBox=\"0 0 480 200\">{bars}<text x=\"200\" y=\"196\">distance from the surface, mm</text></svg>\
         <figcaption>Points by distance; the last bar takes all beyond {:.2} mm. Within 1, 2, 3 of their own stated \
         standard deviations: {:.1}, {:.1}, {:.1} % (a normal distribution: 68.3, 95.4, 99.7).</figcaption></figure>",
        (j.histogram.len() - 1) as f64 * HISTOGRAM_STEP,
        100.0 * j.within_sigmas[0],
        100.0 * j.within_sigmas[1],
        100.0 * j.within_sigmas[2]
    );
    if scan.join("error_picture.png").exists() {
        body.push_str(&picture(
            scan,
            "error_picture.png",
            "Distance of each cell of the height map from the true surface",
        )?);
    }
    body.push_str("</div><table><tr><th>where</th><th>points</th><th>median mm</th><th>rms mm</th><th>95 % mm</th><th>largest mm</th><th>beyond 1 mm</th></tr>");
    let mut row = |name: &str, e: &CloudErrors| {
        let _ = write!(
            body,
            "<tr><td>{}</td><td>{}</td><td>{:.4}</td><td>{:.4}</td><td>{:.4}</td><td>{:.3}</td><td>{:.3} %</td></tr>",
            escape(name),
            thousands(e.points as u64),
            e.median_mm,
            e.rms_without_outliers_mm,
            e.p95_mm,
            e.largest_mm,
            100.0 * e.outliers_share
        );
    };
    row("everything", &j.cloud);
    j.by_part.iter().for_each(|(name, e)| row(name, e));
    body.push_str("</table><p class=\"small\">rms without the points beyond 1 mm. Exact on faces; beside the edges of holes the distance is a lower bound.</p></section>");
    Ok(())
}

fn parts(body: &mut String, scan: &Path, found: &[FoundPart]) -> Result<()> {
    if found.is_empty() {
        return Ok(());
    }
    body.push_str(
        "<section><h2>Parts found, and where the robot inserts</h2><table><tr><th>part</th><th>pose</th>\
         <th>error x mm</th><th>error y mm</th><th>error z mm</th><th>error degrees</th><th>stated sigma x y z mm</th></tr>",
    );
    for f in found {
        let error = f.error_mm.map_or("<td>-</td>".repeat(3), |e| e.map(|x| format!("<td>{x:+.3}</td>")).concat());
        let degrees = f.error_deg.map_or("-".into(), |d| format!("{d:.3}"));
        let pose = if f.passed { "given".into() } else { format!("refused: {}", f.reasons.join("; ")) };
        let _ = write!(
            body,
            "<tr><td>{}</td><td class=\"left\">{}</td>{error}<td>{degrees}</td><td>{:.3} {:.3} {:.3}</td></tr>",
            escape(&f.title),
            escape(&pose),
            f.sigma_mm[0],
            f.sigma_mm[1],
            f.sigma_mm[2]
        );
    }
    body.push_str("</table>");
    for f in found.iter().filter(|f| !f.picture.is_empty()) {
        body.push_str(&picture(scan, &f.picture, &f.title)?);
    }
    body.push_str("</section>");
    Ok(())
}

fn shots(body: &mut String, scan: &Path) -> Result<()> {
    let folder = scan.join("overlays");
    let Ok(entries) = std::fs::read_dir(&folder) else { return Ok(()) };
    let mut names: Vec<String> = entries
        .flatten()
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .filter(|n| n.ends_with(".png"))
        .collect();
    names.sort_by_key(|n| crate::files::natural(n));
    if names.is_empty() {
        return Ok(());
    }
    body.push_str("<section><h2>Shots with their peaks</h2><p>Every peak that was found, in the colour of what became of it. Rejected peaks are kept with their reason.</p>");
    for name in &names {
        body.push_str(&picture(&folder, name, &name.replace(".png", "").replace('_', " "))?);
    }
    body.push_str("</section>");
    Ok(())
}

fn peaks(body: &mut String, r: &ScanReport) {
    let all: u64 = r.peaks.values().sum();
    body.push_str(
        "<section><h2>What became of the peaks</h2><table><tr><th>fate</th><th>peaks</th><th>share</th></tr>",
    );
    let mut rows: Vec<_> = r.peaks.iter().collect();
    rows.sort_by_key(|(_, n)| std::cmp::Reverse(**n));
    for (fate, n) in rows {
        let share = *n as f64 / all.max(1) as f64;
        let _ =
            write!(body, "<tr><td>{}</td><td>{}</td><td>{:.3} %</td></tr>", escape(fate), thousands(*n), 100.0 * share);
    }
    body.push_str("</table>");
    let _ = write!(body, "<p>{}.</p>", escape(&r.seen.words()));
    if !r.dark_shots.is_empty() {
        let _ = write!(body, "<p>{} shots without a stripe.</p>", r.dark_shots.len());
    }
    for remark in &r.remarks {
        let _ = write!(body, "<p>Note: {}</p>", escape(remark));
    }
    for (name, why) in &r.skipped {
        let _ = write!(body, "<p>Left out {}: {}</p>", escape(name), escape(why));
    }
    body.push_str("</section>");
}

fn machine(body: &mut String, r: &ScanReport) {
    let mut rows = vec![
        ("ran on".to_owned(), r.ran_on.clone()),
        ("time".into(), format!("{:.2} s, {:.1} shots/s", r.seconds, r.shots_per_second)),
        ("pictures".into(), format!("{}×{}, {} bits", r.image.width, r.image.height, r.image.bits)),
        ("calibration".into(), format!("rig {}", r.rig_fingerprint.chars().take(16).collect::<String>())),
    ];
    if let Some(s) = &r.stripe {
        rows.push(("stripe".into(), format!("{:.2} px wide (1 sigma), speckle contrast {:.2}", s.width_px, s.speckle)));
    }
    if let Some(h) = &r.height_map {
        rows.push(("height map".into(), format!("{}×{} cells of {:.3} mm", h.width, h.height, h.cell_mm)));
    }
    body.push_str("<section><h2>Machine and settings</h2><table>");
    for (what, value) in rows {
        let _ = write!(body, "<tr><td>{}</td><td class=\"left\">{}</td></tr>", escape(&what), escape(&value));
    }
    body.push_str("</table><p class=\"small\">Beside this page: cloud.ply, cloud.pcd (points), height.tif, height.png + height.json (heights), scan.json (every figure).</p></section>");
}

/// Bytes as text that a page or a JSON file carries.
pub fn base64(bytes: &[u8]) -> String {
    BASE64_STANDARD.encode(bytes)
}

/// A picture as part of the page.
fn picture(folder: &Path, name: &str, caption: &str) -> Result<String> {
    let path = folder.join(name);
    let bytes = crate::files::read(&path, MOST_PICTURE)?;
    Ok(format!(
        "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>",
        escape(caption),
        base64(&bytes)
    ))
}

/// A canvas that shows the points and turns with the mouse.
fn view(body: &mut String, scan: &Path, map: &HeightMap) -> Result<()> {
    let cloud = CloudFile::open(&scan.join("cloud.ply"))?;
    let grid_from_base = map.base_from_grid.inverse();
    let (low, high) = map.quantiles(0.005, 0.995).unwrap_or((0.0, 1.0));
    let low = low - 0.12 * (high - low);
    let middle = Vec3::new(0.5 * f64::from(map.width) * map.cell, 0.5 * f64::from(map.height) * map.cell, 0.0);
    let every = cloud.count().div_ceil(VIEW_POINTS).max(1);
    let (mut bytes, mut i) = (Vec::new(), 0u64);
    cloud.for_each_chunk(&mut |chunk| {
        for p in chunk {
            i += 1;
            if (i - 1) % every != 0 {
                continue;
            }
            let q = grid_from_base.point(&Vec3::from(p.position.map(f64::from))) - middle;
            // 0.02 mm steps in 16 bits: +-655 mm.
            q.iter().for_each(|x| bytes.extend(((x / 0.02).round().clamp(-32_767.0, 32_767.0) as i16).to_le_bytes()));
        }
    })?;
    let stops: Vec<[u8; 3]> = (0..32).map(|i| crate::raster::colour::ordered(i as f32 / 31.0)).collect();
    let _ = write!(
        body,
        "<figure><canvas id=\"view\" width=\"1100\" height=\"560\"></canvas><figcaption>The points themselves ({} of {}): drag to turn, wheel to zoom.</figcaption></figure>\
         <script>const B=\"{}\",LOW={low},HIGH={high},MAP={};{VIEWER}</script>",
        thousands(bytes.len() as u64 / 6),
        thousands(cloud.count()),
        base64(&bytes),
        serde_json::to_string(&stops).expect("numbers")
    );
    Ok(())
}

const VIEWER: &str = r#"
(()=>{const raw=Uint8Array.from(atob(B),c=>c.charCodeAt(0)),P=new Int16Array(raw.buffer),n=P.length/3,c=document.getElementById('view'),g=c.getContext('2d');
let yaw=-0.35,pitch=0.85,zoom=1,reach=1;for(let i=0;i<n;i++)reach=Math.max(reach,Math.hypot(P[3*i],P[3*i+1]));
function draw(){const w=c.width,h=c.height,im=g.createImageData(w,h),d=im.data,z=new Float32Array(w*h).fill(-1e9),s=0.98*w*zoom/(2*reach),cy=Math.cos(yaw),sy=Math.sin(yaw),cp=Math.cos(pitch),sp=Math.sin(pitch);
for(let i=0;i<w*h;i++){d[4*i]=18;d[4*i+1]=20;d[4*i+2]=24;d[4*i+3]=255}
for(let i=0;i<n;i++){const x=P[3*i],y=P[3*i+1],t=P[3*i+2],a=cy*x-sy*y,b=sy*x+cy*y,u=Math.round(w/2+s*a),v=Math.round(h/2-s*(b*cp+t*sp)),k=t*cp-b*sp,f=Math.max(0,Math.min(1,(t*0.02-LOW)/(HIGH-LOW))),q=MAP[Math.round(31*f)];
const r=s>0.08?3:2;for(let e=0;e<r;e++)for(let j=0;j<r;j++){const X=u+e,Y=v+j;if(X<0||Y<0||X>=w||Y>=h)continue;const o=Y*w+X;if(k>z[o]){z[o]=k;d[4*o]=q[0];d[4*o+1]=q[1];d[4*o+2]=q[2]}}}
g.putImageData(im,0,0)}
let last=null;c.onpointerdown=e=>{last=[e.clientX,e.clientY];c.setPointerCapture(e.pointerId)};c.onpointerup=()=>last=null;
c.onpointermove=e=>{if(!last)return;yaw+=(e.clientX-last[0])*0.006;pitch=Math.max(0,Math.min(1.57,pitch+(e.clientY-last[1])*0.006));last=[e.clientX,e.clientY];draw()};
c.onwheel=e=>{e.preventDefault();zoom=Math.max(0.3,Math.min(20,zoom*Math.exp(-e.deltaY*0.001)));draw()};draw()})();"#;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;margin:0;background:#0f1115;color:#dfe4ea}main{max-width:72rem;margin:0 auto;padding:1.5rem}\
h1{font-size:1.7rem;margin:.2rem 0}header p{color:#8b96a3;margin:.1rem 0 1rem}h2{font-size:1.15rem;margin:2.2rem 0 .6rem;color:#fff}\
.cards{display:grid;grid-template-columns:repeat(auto-fit,minmax(10rem,1fr));gap:.8rem}.card{background:#191d24;border-radius:.6rem;padding:.8rem 1rem}\
.card b{display:block;font-size:1.35rem;color:#7fe0b0;font-variant-numeric:tabular-nums}.card span{color:#98a3b0;font-size:.85rem}\
figure{margin:.8rem 0}img,canvas{max-width:100%;height:auto;border-radius:.5rem;display:block;background:#121418}canvas{cursor:grab;touch-action:none}\
figcaption{color:#8b96a3;font-size:.85rem;margin-top:.3rem}.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(24rem,1fr));gap:1rem}\
table{border-collapse:collapse;font-variant-numeric:tabular-nums;margin:.6rem 0}td,th{padding:.25rem .9rem;border-bottom:1px solid #2a303a;text-align:right}\
td:first-child,th:first-child,td.left{text-align:left}svg{width:100%;background:#161a20;border-radius:.5rem}rect{fill:#4fb6a0}svg text{fill:#98a3b0;font-size:12px}\
.small,footer{color:#77828e;font-size:.85rem}footer{margin:3rem 0 1rem}";

fn thousands(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push(',');
        }
        out.push(c);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_counts_are_read_in_threes() {
        assert_eq!(thousands(1_234_567), "1,234,567");
        assert_eq!(thousands(999), "999");
    }
}
