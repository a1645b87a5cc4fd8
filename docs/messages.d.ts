// Made from src/web/message by the test `messages`; SHEETLIGHT_WRITE=1 makes it again.

export type Mode = "live" | "replay" | "simulated";

export type RobotState = "no_link" | "read_only" | "armed" | "moving";

export type Frames = { 
/**
 * Handed to the stages.
 */
seen: number, 
/**
 * With at least one point.
 */
measured: number, 
/**
 * Left out, by cause.
 */
dropped: Record<string, number>, };

export type CalibrationAge = { 
/**
 * Days since the oldest record was measured.
 */
days: number, 
/**
 * The worst verdict of all records.
 */
verdict: string, 
/**
 * Which record has it.
 */
worst: string, 
/**
 * Root of the sum of squares of what each expects at the working distance, mm; null where one does not say.
 */
expected_mm: number | null, };

export type Lease = { 
/**
 * A short name of the tab that holds it; null: nobody.
 */
holder: string | null, 
/**
 * Seconds until it falls free.
 */
seconds_left: number, };

export type Bar = { 
/**
 * Where pictures come from.
 */
mode: Mode, 
/**
 * Name of the station.
 */
station: string, 
/**
 * A camera was named.
 */
camera: boolean, 
/**
 * What the robot may do.
 */
robot: RobotState, 
/**
 * Line or pointer is on, by the controller's outputs; null without a link that can say.
 */
laser: boolean | null, 
/**
 * Of the running scan.
 */
frames: Frames, 
/**
 * From a picture to its points, p50 and p99, ms; null where none was measured yet.
 */
delay_ms: [number, number] | null, 
/**
 * What the stages run on.
 */
adapter: string, 
/**
 * It is software on this machine's cores.
 */
adapter_is_software: boolean, 
/**
 * Null without camera, laser plane or what carries them.
 */
calibration: CalibrationAge | null, 
/**
 * On the disk that holds the jobs, GB; null where the system does not say.
 */
disk_left_gb: number | null, 
/**
 * Memory of the program, now and at its most, MB; null where the system does not say.
 */
memory_mb: [number, number] | null, 
/**
 * What an operator must know now, one sentence each.
 */
alarms: Array<string>, 
/**
 * Who operates.
 */
lease: Lease, 
/**
 * The job that runs.
 */
running: string | null, 
/**
 * Browsers that look on.
 */
viewers: number, };

export type JobState = "queued" | "running" | "done" | "failed" | "stopped" | "cut_off";

export type Problem = { 
/**
 * usage, input, refused, output or device.
 */
kind: string, 
/**
 * What happened, with its number and limit.
 */
what: string, 
/**
 * Likely cause; may be empty.
 */
cause: string, 
/**
 * Next step; may be empty.
 */
next: string, };

export type Target = "camera" | "hand_eye" | "laser_plane" | "pointer" | "axis";

export type TeachOrder = { 
/**
 * The job that scanned it.
 */
scan: string, 
/**
 * What the recipe is called.
 */
name: string, 
/**
 * Corners of the body before it is turned: x0 y0 x1 y1, mm in the grid.
 */
outline: [number, number, number, number], 
/**
 * Its turn about its centre, degrees.
 */
angle_deg: number, 
/**
 * Windows in the body, corners as above.
 */
windows: Array<[number, number, number, number]>, 
/**
 * Round holes: x, y, radius.
 */
holes: Array<[number, number, number]>, 
/**
 * What the insertion bears in the plane, mm.
 */
tolerance_mm: number, 
/**
 * What it bears as a turn, degrees.
 */
tolerance_deg: number, 
/**
 * The tool's way above the insertion pose before and after, mm.
 */
approach_mm: number, 
/**
 * It takes the place of the station's own recipe of that name.
 */
replace: boolean, };

export type Plain = Record<string, never>;

export type ScanOrder = { 
/**
 * Which one.
 */
recording: string, 
/**
 * Edge of a cell, mm; null: what the points bear.
 */
cell_mm?: number | null, 
/**
 * auto, gpu or cpu; null: auto.
 */
on?: string | null, 
/**
 * Leave out shots that cannot be read.
 */
skip_bad: boolean, 
/**
 * Settings other than the station's: keys of [extraction] in station.toml, with dots, and their values.
 */
settings: Record<string, unknown>, };

export type Filter = { "filter": "sigma", 
/**
 * mm.
 */
most_mm: number, } | { "filter": "heights", 
/**
 * mm.
 */
low_mm: number, 
/**
 * mm.
 */
high_mm: number, } | { "filter": "cut", 
/**
 * Two opposite corners: x0 y0 x1 y1, mm.
 */
corners: [number, number, number, number], } | { "filter": "keep", 
/**
 * Two opposite corners: x0 y0 x1 y1, mm.
 */
corners: [number, number, number, number], } | { "filter": "islands", 
/**
 * Fewer than so many go.
 */
least_cells: number, 
/**
 * Neighbours that differ by more are of two pieces, mm.
 */
step_mm: number, };

export type Filters = { 
/**
 * In their order.
 */
filters: Array<Filter>, };

export type Filtered = { 
/**
 * In their order.
 */
filters: Array<Filter>, 
/**
 * Cells that each takes.
 */
cells: Array<number>, 
/**
 * Cells that are left.
 */
left: number, };

export type FilterOrder = { 
/**
 * The job that scanned.
 */
scan: string, 
/**
 * In their order.
 */
filters: Array<Filter>, };

export type FindOrder = { 
/**
 * Jobs that scanned.
 */
scans: Array<string>, 
/**
 * Name of the recipe.
 */
recipe: string, 
/**
 * Two places in the first scan's map, mm: the tool goes where the middle of the pins there says; null: where the
 * recipe says.
 */
pins?: [[number, number], [number, number]] | null, };

export type TouchOrder = { 
/**
 * Which recording of the pointer.
 */
recording: string, };

export type CalibrateOrder = { 
/**
 * What.
 */
target: Target, 
/**
 * From which recording.
 */
recording: string, 
/**
 * Frames to leave out, from 0.
 */
leave_out: Array<number>, };

export type JointOrder = { 
/**
 * Recordings of boards.
 */
recordings: Array<string>, };

export type AutoOrder = { 
/**
 * Name of the board's description in the station's folder boards.
 */
board: string, 
/**
 * Expected error of a scanned point at which it is enough, mm rms.
 */
target_mm: number, 
/**
 * Stops at most, 20 to 200; null: 40.
 */
most?: number | null, };

export type InsertOrder = { 
/**
 * Name of the recipe.
 */
recipe: string, 
/**
 * The line sweeps over so much about the picture's middle, mm; null: the field's short side.
 */
sweep_mm?: number | null, 
/**
 * Speed of every motion, mm/s; null: the station's.
 */
speed_mm_s?: number | null, 
/**
 * Where it was cut off it goes back up instead of on.
 */
back_out: boolean, };

export type BenchmarkOrder = { 
/**
 * Pictures a second of the camera whose drops are counted; null: 30.
 */
rate_hz?: number | null, };

export type Order = { "procedure": "check" } & Plain | { "procedure": "scan" } & ScanOrder | { "procedure": "filter" } & FilterOrder | { "procedure": "find" } & FindOrder | { "procedure": "teach" } & TeachOrder | { "procedure": "touch" } & TouchOrder | { "procedure": "tune" } & Plain | { "procedure": "calibrate" } & CalibrateOrder | { "procedure": "joint" } & JointOrder | { "procedure": "auto" } & AutoOrder | { "procedure": "insert" } & InsertOrder | { "procedure": "benchmark" } & BenchmarkOrder;

export type CheckLine = { 
/**
 * station, camera, robot, gpu, disk or clock.
 */
group: string, 
/**
 * What was looked at.
 */
name: string, 
/**
 * good, poor (works, but read it), bad or absent.
 */
state: string, 
/**
 * What was seen, with its number and limit.
 */
says: string, };

export type ScanFigures = { 
/**
 * Shots done, those left out included.
 */
shots: number, 
/**
 * Points of the cloud.
 */
points: number, 
/**
 * Size of the pictures, px.
 */
width: number, 
/**
 * Rows, px.
 */
height: number, 
/**
 * Frame of the cloud: base, axis or flange.
 */
frame: string, 
/**
 * Median of the points' own standard deviations, mm.
 */
median_sigma_mm: number | null, 
/**
 * Share of the map's cells that were measured.
 */
coverage: number | null, 
/**
 * Edge of a cell, mm.
 */
cell_mm: number | null, 
/**
 * Heights between which 98 % of the map lies, mm.
 */
z_mm: [number, number] | null, 
/**
 * Peaks by fate.
 */
peaks: Record<string, number>, 
/**
 * Shots without a point.
 */
dark_shots: number, 
/**
 * Shots left out: name and reason.
 */
skipped: Array<[string, string]>, 
/**
 * From the first shot to the closed cloud, s.
 */
seconds: number, 
/**
 * Shots a second of this run.
 */
shots_per_second: number, 
/**
 * Adapter, or this machine's processor and why.
 */
ran_on: string, 
/**
 * Seconds by what the main thread did.
 */
spent: Record<string, number>, 
/**
 * What a reader must know.
 */
remarks: Array<string>, };

export type Notation = { 
/**
 * Name of the convention.
 */
name: string, 
/**
 * One a number, with its unit.
 */
labels: Array<string>, 
/**
 * In the order of the labels.
 */
numbers: Array<number>, };

export type RobotPoses = { 
/**
 * Changes with every number here: a confirmation names the poses that were shown by it.
 */
hash: string, 
/**
 * The station's own notation.
 */
convention: string, 
/**
 * One a number, with its unit.
 */
labels: Array<string>, 
/**
 * Above the insertion.
 */
approach: Array<number>, 
/**
 * The tool at its place.
 */
insertion: Array<number>, 
/**
 * Above it, on the way back.
 */
retract: Array<number>, 
/**
 * The insertion in every notation.
 */
notations: Array<Notation>, };

export type Term = { 
/**
 * Its name.
 */
name: string, 
/**
 * Along x, y, z of the part, mm; null where it is not known.
 */
sigma_mm: [number, number, number] | null, 
/**
 * About them, degrees.
 */
sigma_deg: [number, number, number] | null, 
/**
 * What it is.
 */
note: string, };

export type GateLight = { 
/**
 * What is judged, with its unit.
 */
name: string, 
/**
 * What was seen.
 */
value: number, 
/**
 * What it is held against.
 */
limit: number, 
/**
 * Kept.
 */
passed: boolean, };

export type Position = { 
/**
 * Name of the recipe.
 */
recipe: string, 
/**
 * Frame of the poses.
 */
frame: string, 
/**
 * Every gate was passed.
 */
passed: boolean, 
/**
 * Which were not, in words.
 */
reasons: Array<string>, 
/**
 * Null where a gate was missed.
 */
poses: RobotPoses | null, 
/**
 * One standard deviation along x, y, z of the part, mm.
 */
sigma_mm: [number, number, number], 
/**
 * One standard deviation of the turns about them, degrees.
 */
sigma_deg: [number, number, number], 
/**
 * What the insertion bears in the plane, mm.
 */
tolerance_mm: number, 
/**
 * What it bears as a turn, degrees.
 */
tolerance_deg: number, 
/**
 * 3 sigma within both.
 */
within_tolerance: boolean, 
/**
 * Where the sigma comes from.
 */
terms: Array<Term>, 
/**
 * False: a term is unknown, the sum is a lower bound.
 */
complete: boolean, 
/**
 * Each gate with its number and limit.
 */
gates: Array<GateLight>, 
/**
 * Score of the match, and of the next best.
 */
score: number, 
/**
 * Of the next best pose.
 */
second_score: number, 
/**
 * The part in the scan's frame: row-major 4x4, mm.
 */
part: [number, number, number, number, number, number, number, number, number, number, number, number, number, number, number, number], 
/**
 * The drawing's outlines in the height map's grid, mm.
 */
outline: Array<Array<[number, number]>>, 
/**
 * What else a reader must know.
 */
notes: Array<string>, };

export type SurfaceTouched = { 
/**
 * Unit length, towards the camera; base frame.
 */
normal: [number, number, number], 
/**
 * Middle of the spots, base frame, mm.
 */
centre_mm: [number, number, number], 
/**
 * Standard deviation of its tilt: worst direction, and across it, degrees.
 */
tilt_sigma_deg: [number, number], 
/**
 * How far the spots lie off it, rms, mm.
 */
rms_mm: number, 
/**
 * Angle between it and the base's z, degrees.
 */
tilt_deg: number, 
/**
 * A spot that does not lie on the plane of the others.
 */
left_out: string | null, };

export type SquareProposed = { 
/**
 * How far the tool leant at the last shot, degrees.
 */
tilt_deg: number, 
/**
 * One standard deviation of that.
 */
tilt_sigma_deg: number, 
/**
 * How the robot writes poses.
 */
convention: string, 
/**
 * Names of the numbers.
 */
labels: Array<string>, 
/**
 * Where the flange goes, base frame.
 */
flange: Array<number>, 
/**
 * Where the tool is then, base frame.
 */
tool: Array<number>, };

export type Touched = { 
/**
 * Picture, distance from the camera along its axis and its standard deviation, mm.
 */
spots: Array<[string, number, number]>, 
/**
 * The plane through them.
 */
surface: SurfaceTouched | null, 
/**
 * How to stand square to it; null without a surface or without the station's tool.
 */
square: SquareProposed | null, 
/**
 * Pictures without a distance: name and reason.
 */
missing: Array<[string, string]>, 
/**
 * What a reader must know.
 */
remarks: Array<string>, };

export type CalibrationFigures = { 
/**
 * What was calibrated, as files call it.
 */
kind: string, 
/**
 * good, usable, badly determined or refused.
 */
verdict: string, 
/**
 * Why.
 */
reasons: Array<string>, 
/**
 * The next best picture.
 */
advice: Array<string>, 
/**
 * Named figures, unit in the name.
 */
figures: Record<string, number>, 
/**
 * The same of the station's present one; empty without.
 */
former: Record<string, number>, 
/**
 * Residual a picture; unit in the heading of the page.
 */
per_picture: Array<[string, number]>, 
/**
 * Pictures that were not used: name and reason.
 */
left_out: Array<[string, string]>, 
/**
 * It was stored in the station.
 */
accepted: boolean, };

export type Inserted = { 
/**
 * From the beginning to the confirmed position, s.
 */
time_to_position_s: number | null, 
/**
 * Motions that were confirmed until then.
 */
confirmations_to_position: number | null, 
/**
 * Work and waits, s.
 */
seconds: number, 
/**
 * Motions that were confirmed.
 */
confirmations: number, 
/**
 * Where the part was found; null where it was found before the program was started again.
 */
found: Position | null, };

export type StripeSeen = { 
/**
 * It lies: it is looked at column by column.
 */
lying: boolean, 
/**
 * Level that a twentieth of its peaks are above, share of full scale.
 */
peak: number, 
/**
 * Where that is to stand.
 */
wanted: [number, number], 
/**
 * Share of its peaks that are saturated.
 */
saturated: number, 
/**
 * Full width at half height, px, median.
 */
width_px: number, 
/**
 * Its peak against the level beside it, median.
 */
contrast: number, 
/**
 * Share of the lines without a stripe.
 */
dark: number, 
/**
 * Exposure is right.
 */
right: boolean, 
/**
 * The same in pieces along it, from the left or the top: peak, width in px, contrast, dark share; the first
 * three are 0 where it is dark.
 */
pieces: Array<[number, number, number, number]>, };

export type PictureLook = { 
/**
 * Lowest, median, 99th percentile, highest level.
 */
levels: [number, number, number, number], 
/**
 * Share of saturated pixels.
 */
saturated: number, 
/**
 * Null where no line of the picture shows a stripe.
 */
stripe: StripeSeen | null, };

export type ExposureSet = { 
/**
 * us; it is set.
 */
exposure_us: number, 
/**
 * What was tried: us, and where the stripe's peaks stood, share of full scale; null: no stripe.
 */
tried: Array<[number, number | null]>, 
/**
 * What pictures show now.
 */
look: PictureLook, 
/**
 * Where no exposure is quite right: why this one is the best.
 */
remark: string | null, };

export type CameraFeature = { 
/**
 * By the naming convention.
 */
name: string, 
/**
 * What it is; null where it cannot be read.
 */
value: number | boolean | string | null, 
/**
 * us, dB, px, Hz; empty where it has none.
 */
unit: string, 
/**
 * Lowest and highest; null: none that is known.
 */
range: [number, number] | null, 
/**
 * One of these; empty: not a list.
 */
words: Array<string>, 
/**
 * Whether it can be set now.
 */
writable: boolean, };

export type CameraState = { 
/**
 * What it can be set to; empty where nothing can, or while it is not there.
 */
features: Array<CameraFeature>, };

export type SetFeature = { 
/**
 * By the naming convention, e.g. ExposureTime.
 */
name: string, 
/**
 * As text.
 */
value: string, };

export type BenchRow = { 
/**
 * What it ran on.
 */
on: string, 
/**
 * Columns, px.
 */
width: number, 
/**
 * Rows, px.
 */
height: number, 
/**
 * Of the whole chain, ms.
 */
ms_per_shot: number, };

export type KeptUp = { 
/**
 * What it ran on.
 */
on: string, 
/**
 * Columns, px.
 */
width: number, 
/**
 * Rows, px.
 */
height: number, 
/**
 * Pictures a second that were sent.
 */
rate_hz: number, 
/**
 * Pictures that were sent.
 */
sent: number, 
/**
 * Of these with points.
 */
measured: number, 
/**
 * Passed over, because a newer one had come.
 */
passed_over: number, 
/**
 * Lost otherwise.
 */
lost: number, 
/**
 * From the last byte to the points, p50 and p99, ms.
 */
ms: [number, number], };

export type Outcome = { "procedure": "check", 
/**
 * In the order in which they were made.
 */
lines: Array<CheckLine>, } | { "procedure": "scan" } & ScanFigures | { "procedure": "find" } & Position | { "procedure": "teach", 
/**
 * Name of the recipe.
 */
recipe: string, 
/**
 * Found on its own scan.
 */
proof: Position, } | { "procedure": "touch" } & Touched | { "procedure": "tune" } & ExposureSet | { "procedure": "calibrate" } & CalibrationFigures | { "procedure": "joint" } & CalibrationFigures | { "procedure": "auto" } & CalibrationFigures | { "procedure": "insert" } & Inserted | { "procedure": "benchmark", 
/**
 * One a size and processor.
 */
rows: Array<BenchRow>, 
/**
 * The same of other machines, as they were recorded.
 */
recorded: Array<BenchRow>, 
/**
 * What of a camera was measured and what was dropped, at half and at full resolution.
 */
kept_up: Array<KeptUp>, };

export type Job = { 
/**
 * Version of job.json: 1.
 */
format: number, 
/**
 * Name of its folder, e.g. `0007-scan`.
 */
id: string, 
/**
 * What was ordered.
 */
order: Order, 
/**
 * What became of it.
 */
state: JobState, 
/**
 * Steps done (shots, pictures, checks).
 */
done: number, 
/**
 * Steps in all; null while nobody knows.
 */
of: number | null, 
/**
 * When it was ordered.
 */
created: string, 
/**
 * Seconds that it ran.
 */
seconds: number, 
/**
 * Why it failed.
 */
problem: Problem | null, 
/**
 * What came of it.
 */
outcome: Outcome | null, 
/**
 * Steps of an interrupted run are kept: resuming goes on there.
 */
resumable: boolean, };

export type Asked = { 
/**
 * The job that asks.
 */
job: string, 
/**
 * One or two words: touch, scan, approach, insert, retract, calibrate.
 */
step: string, 
/**
 * What was found, a sentence a line.
 */
says: Array<string>, 
/**
 * The question.
 */
question: string, 
/**
 * Names this motion and no other: poses, speed, reason and number.
 */
hash: string, 
/**
 * What it has to keep, all of it kept.
 */
gates: Array<GateLight>, 
/**
 * Motions that are confirmed as one.
 */
motions: number, 
/**
 * The fastest of them, mm/s.
 */
speed_mm_s: number, 
/**
 * How the flange's pose is written.
 */
convention: string, 
/**
 * One a number, with its unit.
 */
labels: Array<string>, 
/**
 * Where the flange ends.
 */
numbers: Array<number>, 
/**
 * The button may stay down from the motion before to this one.
 */
stays_down: boolean, 
/**
 * It has to be confirmed within so long after it was shown, s.
 */
within_s: number, };

export type SimulatedCell = { 
/**
 * Parts whose component the gripper can hold.
 */
parts: Array<string>, 
/**
 * Whose it holds.
 */
holds: string, 
/**
 * The arm stands over the part, or over the calibration board.
 */
over_board: boolean, };

export type MotionState = { 
/**
 * A robot was named.
 */
robot: boolean, 
/**
 * The program was started with leave to move it.
 */
may_move: boolean, 
/**
 * A short name of the tab that armed it; null: it is not armed.
 */
armed: string | null, 
/**
 * A confirmed motion is under way.
 */
moving: boolean, 
/**
 * Why somebody has to look at the robot first; null: nobody has to.
 */
look: string | null, 
/**
 * The job that moves it, or the last one that did.
 */
job: string | null, 
/**
 * What waits for a person.
 */
asked: Asked | null, 
/**
 * What the job said so far.
 */
said: Array<string>, 
/**
 * While the last motion was made: the longest that nothing was heard of the held button, ms; null: none was made.
 */
silence_ms: number | null, 
/**
 * Of a calibration: stops so far, expected error then, mm.
 */
expected: Array<[number, number]>, 
/**
 * Null: the robot is none of ours.
 */
simulated: SimulatedCell | null, };

export type Arming = { 
/**
 * False: gives it back.
 */
armed: boolean, };

export type InTheCell = { 
/**
 * Puts the component that belongs to this part into the gripper; null: what it holds stays.
 */
holds?: string | null, 
/**
 * Jogs the arm over the calibration board, else over the part.
 */
over_board: boolean, };

export type Event = { "event": "state", "data": { 
/**
 * The bar.
 */
bar: Bar, 
/**
 * Newest first, at most 200.
 */
jobs: Array<Job>, 
/**
 * The robot as it may be moved from here.
 */
motion: MotionState, } } | { "event": "bar", "data": Bar } | { "event": "job", "data": Job } | { "event": "motion", "data": MotionState } | { "event": "gone", "data": string };

export type Knock = { 
/**
 * Of this start of the program.
 */
token: string | null, 
/**
 * Where the screen is served to other machines.
 */
password: string | null, };

export type Session = { 
/**
 * A short name of the tab that asks.
 */
tab: string, };

export type TakeLease = { 
/**
 * Also where another one operates.
 */
firmly: boolean, };

export type Confirmed = { 
/**
 * The job that asks.
 */
job: string, 
/**
 * `hash` of the motion that was shown.
 */
hash: string, };

export type Grant = { 
/**
 * The name under which it is redeemed, once.
 */
grant: string, };

export type Redeem = { 
/**
 * What pressing it gave.
 */
grant: string, 
/**
 * What is confirmed, again.
 */
what: Confirmed, };

export type CalibrationState = { 
/**
 * As files call it.
 */
kind: string, 
/**
 * For people.
 */
words: string, 
/**
 * good, usable, badly determined or refused.
 */
verdict: string, 
/**
 * When it was measured.
 */
created: string, 
/**
 * How long ago, days.
 */
days: number, 
/**
 * Expected error of a point at the working distance, mm.
 */
expected_mm: number | null, };

export type FrameInfo = { 
/**
 * tool or camera.
 */
name: string, 
/**
 * flange or base.
 */
on: string, 
/**
 * Names of the numbers.
 */
labels: Array<string>, 
/**
 * mm, degrees or as the notation has them.
 */
numbers: Array<number>, };

export type StationInfo = { 
/**
 * Its name.
 */
name: string, 
/**
 * Where pictures come from.
 */
mode: Mode, 
/**
 * Name and version of the program.
 */
program: string, 
/**
 * How its robot writes poses; null: as matrices.
 */
robot: string | null, 
/**
 * eye-in-hand or eye-to-hand; null: not stated.
 */
mount: string | null, 
/**
 * What the work tolerates, mm.
 */
tolerance_mm: number | null, 
/**
 * Camera depths at which points are believed, mm.
 */
volume_mm: [number, number] | null, 
/**
 * Frame of scans and of the poses that are found in them: base, axis or camera.
 */
work_frame: string, 
/**
 * Frames that are fixed to others, in the robot's notation.
 */
frames: Array<FrameInfo>, 
/**
 * One a calibration that there is.
 */
calibrations: Array<CalibrationState>, 
/**
 * What is wrong with it; null: nothing.
 */
problem: Problem | null, 
/**
 * Names of all settings of the extraction, with dots, and the station's values.
 */
extraction: Record<string, unknown>, };

export type BackupInfo = { 
/**
 * Its file.
 */
name: string, 
/**
 * When it was made.
 */
created: string, 
/**
 * Files of the station in it.
 */
files: number, 
/**
 * Bytes.
 */
bytes: number, };

export type SettingsState = { 
/**
 * station.toml as it lies there.
 */
text: string, 
/**
 * SHA-256 of it: a change names the text that it was made from.
 */
sha256: string, 
/**
 * Its settings by their names with dots; empty where the text cannot be read.
 */
values: Record<string, unknown>, 
/**
 * Notations that poses can be written in.
 */
notations: Array<string>, 
/**
 * The station's folder on the machine that serves the screen.
 */
folder: string, 
/**
 * The folder below which recordings lie.
 */
recordings: string, 
/**
 * Other machines may open the screen, with the password.
 */
secured: boolean, 
/**
 * Newest first.
 */
backups: Array<BackupInfo>, };

export type SettingsAsk = { 
/**
 * SHA-256 of the text that this was made from.
 */
sha256: string, 
/**
 * A new station.toml.
 */
text?: string | null, 
/**
 * Settings by their names with dots; null takes one out. Comments and all else stay.
 */
changes: Record<string, unknown>, };

export type OutputAsk = { 
/**
 * line, pointer or room: lit for a moment; open or close: the gripper.
 */
output: string, };

export type RecordingInfo = { 
/**
 * Path below the recordings' folder.
 */
name: string, 
/**
 * What it calls itself.
 */
set: string, 
/**
 * Moments in it.
 */
frames: number, 
/**
 * Size of its pictures, px.
 */
width: number, 
/**
 * Rows, px.
 */
height: number, 
/**
 * line, pointer; null where no laser is on.
 */
beam: string | null, 
/**
 * It shows a board.
 */
board: boolean, 
/**
 * robot, linear or turntable.
 */
motion: string, 
/**
 * Why it cannot be used; null: it can.
 */
problem: Problem | null, };

export type BoardView = { 
/**
 * What it is called.
 */
name: string, 
/**
 * Its file, in the job.
 */
file: string, 
/**
 * Columns, px.
 */
width: number, 
/**
 * Rows, px.
 */
height: number, 
/**
 * The corners that were found, u and v, px.
 */
corners: Array<[number, number]>, 
/**
 * How far the board's normal leans away from the camera's axis, to the right and downwards in the picture,
 * degrees, by the station's camera or else one as long as its picture is wide; null where too little of the
 * board was found.
 */
lean_deg: [number, number] | null, 
/**
 * Where the axis stood that the board rides on, counts; null without one, or where it is not known.
 */
count: number | null, };

export type ViewRef = { 
/**
 * The recording.
 */
recording: string, 
/**
 * Its frame, from 0.
 */
frame: number, };

export type SupportAsk = { 
/**
 * Somebody ticked it.
 */
pictures: boolean, };

export type PictureRef = { 
/**
 * The recording.
 */
recording: string, 
/**
 * Its frame, from 0.
 */
frame: number, 
/**
 * laser or ambient; without: whichever there is.
 */
light: string | null, 
/**
 * Columns of the answer, 16 to 4096; without: the picture's own.
 */
width: number | null, };

export type RecipeText = { 
/**
 * Name of the file, without extension.
 */
name: string, 
/**
 * What people call the part; read from the text.
 */
title: string, 
/**
 * Ships with the program; it is copied when it is changed.
 */
shipped: boolean, 
/**
 * TOML; empty where it cannot be read at all.
 */
text: string, 
/**
 * What is wrong with it; null: nothing.
 */
problem: Problem | null, };

export type RecipeAsk = { 
/**
 * TOML.
 */
text: string, 
/**
 * It takes the place of the station's own recipe of that name.
 */
replace: boolean, };

export type PointsOf = { 
/**
 * TOML.
 */
text: string, };

export type RecipePoint = { 
/**
 * By which constructions and the insertion name it.
 */
name: string, 
/**
 * In the part's frame, as drawn, mm.
 */
at: [number, number], 
/**
 * shape, grid, or the construction's: midpoint, line, intersection, offset, lattice.
 */
kind: string, 
/**
 * The tool goes there.
 */
chosen: boolean, };

export type NewPoint = { 
/**
 * By which later ones and the insertion name it.
 */
name: string, 
/**
 * midpoint, line, intersection, offset or lattice.
 */
kind: string, 
/**
 * Names of shapes, or of points before it.
 */
of: Array<string>, 
/**
 * Of an offset: the line or lattice that gives the direction.
 */
along?: string | null, 
/**
 * Of an offset: along and across, mm.
 */
by_mm?: [number, number] | null, };

export type PointChange = { "add": NewPoint } | { "take_out": { 
/**
 * Which one.
 */
name: string, } } | { "choose": { 
/**
 * Which one; null: the part's own place.
 */
name: string | null, } };

export type PointsChange = { 
/**
 * TOML; it need not be stored.
 */
text: string, 
/**
 * What changes.
 */
change: PointChange, };

export type PointsChanged = { 
/**
 * TOML, with all comments that it had.
 */
text: string, 
/**
 * Its points now.
 */
points: Array<RecipePoint>, };

export type DrawingAsk = { 
/**
 * What the recipe is called.
 */
name: string, 
/**
 * ASCII DXF.
 */
text: string, 
/**
 * mm, inch, cm, m, um, mil or foot, where the drawing names none; null: the one it names.
 */
unit?: string | null, 
/**
 * Layers that hold the part's edges; none: all that are shown.
 */
layers: Array<string>, 
/**
 * The insertion datum in the drawing, in its unit; null: the middle of the largest outline's box.
 */
origin?: [number, number] | null, 
/**
 * How many turns make the part look nearly alike.
 */
alike_turns: number, 
/**
 * Edge of a cell of the map that is searched, mm.
 */
cell_mm: number, 
/**
 * What the insertion bears in the plane, mm.
 */
tolerance_mm: number, 
/**
 * What it bears as a turn, degrees.
 */
tolerance_deg: number, 
/**
 * The tool's way above the insertion pose before and after, mm.
 */
approach_mm: number, 
/**
 * It takes the place of the station's own recipe of that name.
 */
replace: boolean, };

export type DrawingRead = { 
/**
 * The recipe, stored.
 */
recipe: RecipeText, 
/**
 * Width and height of what was drawn, mm.
 */
size_mm: [number, number], 
/**
 * What was passed over, and what to look at.
 */
notes: Array<string>, };

export type MapHead = { 
/**
 * Columns.
 */
width: number, 
/**
 * Rows.
 */
height: number, 
/**
 * Edge of a cell, mm; the centre of cell (i, j) is at ((i + 0.5) cell, (j + 0.5) cell).
 */
cell_mm: number, 
/**
 * Grid in the cloud's frame: row-major 4x4, mm.
 */
base_from_grid: [number, number, number, number, number, number, number, number, number, number, number, number, number, number, number, number], 
/**
 * Heights between which 99 % lies, mm.
 */
z_mm: [number, number], 
/**
 * The same of the standard deviation, mm.
 */
sigma_mm: [number, number], 
/**
 * The same of the stripe's amplitude, grey levels.
 */
intensity: [number, number], };

export type Outlines = { 
/**
 * The scan's: base, axis, flange or map.
 */
frame: string, 
/**
 * One a shape, x y z in that frame, mm; closed ones end where they begin.
 */
lines: Array<Array<[number, number, number]>>, };

export type Ghost = { 
/**
 * The picture over which they belong.
 */
number: number, 
/**
 * u and v, px; lines end where they leave what the lens shows.
 */
lines: Array<Array<[number, number]>>, 
/**
 * So far the arm moved them between the readings of its pose before and after the picture, px; 0: it stood.
 */
moved_px: number, };

export type SectionAsk = { 
/**
 * Where it begins, mm.
 */
from: [number, number], 
/**
 * Where it ends, mm.
 */
to: [number, number], 
/**
 * Pieces of it to which lines are fitted: from and to along the section, mm; at most two.
 */
fits: Array<[number, number]>, };

export type SectionPoint = { 
/**
 * Along the section, mm.
 */
s: number, 
/**
 * Height; null where nothing was measured.
 */
z: number | null, 
/**
 * Its standard deviation, mm.
 */
sigma: number | null, };

export type Distance = { 
/**
 * mm, or degrees where it is an angle.
 */
value: number, 
/**
 * One standard deviation, in the same unit.
 */
sigma: number, };

export type Fit = { 
/**
 * Where it begins and ends along the section, mm.
 */
piece: [number, number], 
/**
 * Height at its middle, mm.
 */
height_mm: number, 
/**
 * Standard deviation of that, mm.
 */
height_sigma_mm: number, 
/**
 * Its angle against the grid's plane, degrees.
 */
angle_deg: number, 
/**
 * Standard deviation of that, degrees.
 */
angle_sigma_deg: number, 
/**
 * How far the places lie off it, rms, mm.
 */
rms_mm: number, 
/**
 * Places that it was fitted to.
 */
places: number, };

export type Section = { 
/**
 * Its length, mm.
 */
length_mm: number, 
/**
 * A place each half cell.
 */
points: Array<SectionPoint>, 
/**
 * One a piece.
 */
fits: Array<Fit>, 
/**
 * Height of the second piece's middle over the first one's line, mm; with two pieces.
 */
step: Distance | null, 
/**
 * Angle between the two lines, degrees.
 */
angle: Distance | null, };

export type PointsAsk = { 
/**
 * mm in the grid.
 */
a: [number, number], 
/**
 * mm in the grid.
 */
b: [number, number], };

export type PlaneAsk = { 
/**
 * mm in the grid.
 */
point: [number, number], 
/**
 * Corners of the box that holds the plane: x0 y0 x1 y1, mm in the grid.
 */
plane: [number, number, number, number], };

export type Measure = { "measure": "two_points" } & PointsAsk | { "measure": "point_to_plane" } & PlaneAsk;

export type MeasureAnswer = { 
/**
 * The distance, mm; of a point above its plane positive.
 */
distance: Distance, 
/**
 * Along x, y, z of the grid, mm; of two points.
 */
along: [number, number, number] | null, 
/**
 * Of the plane against the grid, degrees.
 */
tilt: Distance | null, 
/**
 * How far the plane's cells lie off it, rms, mm.
 */
rms_mm: number | null, 
/**
 * Cells that went in.
 */
cells: number, };

export type SweepAsk = { 
/**
 * Name of the recipe.
 */
recipe: string, 
/**
 * An insertion that touched the board already.
 */
job?: string | null, 
/**
 * From the camera to the board, mm, before it was touched.
 */
distance_mm?: number | null, 
/**
 * Length, mm.
 */
sweep_mm?: number | null, 
/**
 * From one shot to the next, mm.
 */
step_mm?: number | null, 
/**
 * mm/s; without: the fastest that all bear.
 */
speed_mm_s?: number | null, 
/**
 * Pictures a second of another camera than the one that is linked.
 */
camera_hz?: number | null, };

export type Pace = { 
/**
 * mm/s.
 */
speed_mm_s: number, 
/**
 * mm a shot.
 */
step_mm: number, 
/**
 * Pictures a second.
 */
rate_hz: number, 
/**
 * Over the whole length, s.
 */
seconds: number, 
/**
 * camera, chain or speed: the one that allows no more; null: none does.
 */
limited_by: string | null, 
/**
 * The fastest that each of them bears at this step, mm/s.
 */
bears: Array<[string, number]>, 
/**
 * The step that is left at this speed, mm.
 */
left_step_mm: number, };

export type SweepPlan = { 
/**
 * Name of the recipe.
 */
recipe: string, 
/**
 * The board was touched; else it is taken to lie squarely before the camera.
 */
touched: boolean, 
/**
 * From the board to the camera, mm.
 */
depth_mm: number, 
/**
 * From the first shot's stripe to the last one's, mm.
 */
length_mm: number, 
/**
 * From one shot to the next, mm.
 */
step_mm: number, 
/**
 * Pictures.
 */
shots: number, 
/**
 * Across the part however it is turned, mm.
 */
part_mm: number, 
/**
 * What the camera sees of the board: x0 y0 x1 y1, mm.
 */
field_mm: [number, number, number, number], 
/**
 * Ends of the first shot's stripe, then of the last one's, in the order around what is swept, mm.
 */
swept_mm: [[number, number], [number, number], [number, number], [number, number]], 
/**
 * How far the part may lie off the picture's middle along the sweep, mm; negative: it is never swept whole.
 */
along_mm: number, 
/**
 * The same along the stripe.
 */
across_mm: number, 
/**
 * Left of the working volume above the board and below it, mm; null: nobody knows it.
 */
volume_mm: [number, number] | null, 
/**
 * Left to the sides of the flange's box, mm; negative: outside; null: no box is stated or the robot's place is
 * not known.
 */
box_mm: number | null, 
/**
 * Names of a flange pose's numbers.
 */
labels: Array<string>, 
/**
 * The flange at the first and the last shot; empty where the robot's place is not known.
 */
flange: Array<Array<number>>, 
/**
 * What is swept, and how far a part in its middle reaches, in the camera's picture as it stands now, px; empty:
 * not known.
 */
seen_px: Array<Array<[number, number]>>, 
/**
 * Pictures a second that the camera sends; null: not known.
 */
camera_hz: number | null, 
/**
 * Pictures of this size that a scan of this station measured in a second; null: none did.
 */
chain_hz: number | null, 
/**
 * The station's limit, mm/s.
 */
limit_mm_s: number | null, 
/**
 * Of a scan that does not stop for its pictures; null: nothing is known that limits it.
 */
pace: Pace | null, };

export type RepeatsAsk = { 
/**
 * Their names.
 */
jobs: Array<string>, };

export type Spread = { 
/**
 * x, y, z of the frame, or turn.
 */
name: string, 
/**
 * mm or degrees.
 */
unit: string, 
/**
 * One standard deviation of the places.
 */
scatter: number, 
/**
 * What they state of themselves, root mean square.
 */
stated: number, 
/**
 * From the first to the last of them.
 */
apart: number, 
/**
 * The histogram reaches so far to both sides of the median.
 */
half: number, 
/**
 * Places in each of its bars.
 */
bars: Array<number>, };

export type Repeats = { 
/**
 * Of how many.
 */
places: number, 
/**
 * x, y, z, turn; empty of fewer than two.
 */
along: Array<Spread>, };
