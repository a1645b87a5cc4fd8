// Made from program/src/web/message by the test `messages`; SHEETLIGHT_WRITE=1 makes it again.

export type Arming = { 
/**
 * False: disarms it.
 */
armed: boolean, };

export type Asked = { 
/**
 * The job that proposes it.
 */
job: string, 
/**
 * One or two words: touch, scan, approach, insert, retract, calibrate.
 */
step: string, 
/**
 * What was found, one sentence per line.
 */
says: Array<string>, 
/**
 * The question.
 */
question: string, 
/**
 * Identifies this motion: poses, speed, reason and number.
 */
hash: string, 
/**
 * The gates that the motion must pass, all passed.
 */
gates: Array<GateLight>, 
/**
 * Number of motions that are confirmed together.
 */
motions: number, 
/**
 * Speed of the fastest of them, mm/s.
 */
speed_mm_s: number, 
/**
 * Convention in which the flange's pose is written.
 */
convention: string, 
/**
 * One label per number, with its unit.
 */
labels: Array<string>, 
/**
 * Final pose of the flange.
 */
numbers: Array<number>, 
/**
 * The button may stay pressed from the previous motion to this one.
 */
stays_down: boolean, 
/**
 * Time within which it must be confirmed after it was shown, s.
 */
within_s: number, };

export type AutoOrder = { 
/**
 * The board's description (docs/boards.md); over HTTP its name in the station's folder boards
 */
board: string, 
/**
 * Target for the expected error of a scanned point, mm rms; the calibration ends when it is reached
 */
target_mm: number, 
/**
 * Where the camera is: eye-in-hand (on the flange) or eye-to-hand (fixed) [default: the station's, else
 * eye-in-hand with a note]
 */
mount?: string | null, 
/**
 * Largest number of stops, 20 to 200 [default: 40]
 */
most?: number | null, 
/**
 * Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
 */
on?: string | null, };

export type AxisOrder = { 
/**
 * Recording of a board on the axis, with a picture and a count per frame
 */
recording: string, 
/**
 * Frames that are not used, counted from 0
 */
leave_out: Array<number>, 
/**
 * Channel of a colour picture: red, green, blue or luma
 */
channel?: string | null, };

export type BackupInfo = { 
/**
 * Name of its file.
 */
name: string, 
/**
 * When it was made.
 */
created: string, 
/**
 * Number of the station's files in it.
 */
files: number, 
/**
 * Size in bytes.
 */
bytes: number, };

export type Bar = { 
/**
 * Source of the pictures.
 */
mode: Mode, 
/**
 * Name of the station.
 */
station: string, 
/**
 * A camera is configured.
 */
camera: boolean, 
/**
 * What the robot may do.
 */
robot: RobotState, 
/**
 * Line or pointer is on, by the controller's outputs; null if no link reports it.
 */
laser: boolean | null, 
/**
 * Frames of the running scan, or of the last one.
 */
frames: Frames, 
/**
 * Time from a picture to its points, p50 and p99, ms; null if not measured yet.
 */
delay_ms: [number, number] | null, 
/**
 * Adapter or processor that runs the stages.
 */
adapter: string, 
/**
 * The adapter is software on this machine's cores.
 */
adapter_is_software: boolean, 
/**
 * Null without a camera, a laser plane, or the calibration of the motion that carries them.
 */
calibration: CalibrationAge | null, 
/**
 * Free space on the disk that holds the jobs, GB; null if the system does not report it.
 */
disk_left_gb: number | null, 
/**
 * Memory of the program, now and at its peak, MB; null if the system does not report it.
 */
memory_mb: [number, number] | null, 
/**
 * What the operator must know now, one sentence each.
 */
alarms: Array<string>, 
/**
 * The tab that may operate.
 */
lease: Lease, 
/**
 * The running job; null: none runs.
 */
running: string | null, 
/**
 * Number of connected browsers.
 */
viewers: number, };

export type BenchRow = { 
/**
 * Adapter or processor.
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
 * Time of the whole chain, ms.
 */
ms_per_shot: number, };

export type BenchmarkOrder = { 
/**
 * Frame rate of the camera whose drops are counted, Hz; null: 30.
 */
rate_hz?: number | null, };

export type BoardView = { 
/**
 * Name of the picture.
 */
name: string, 
/**
 * Its file in the job's folder.
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
 * The detected corners, u and v, px.
 */
corners: Array<[number, number]>, 
/**
 * Tilt of the board's normal from the camera's axis, to the right and downwards in the picture, degrees. Uses
 * the station's camera, or else a focal length equal to the picture's width in px. Null if too little of the
 * board was found.
 */
lean_deg: [number, number] | null, 
/**
 * Position of the axis that carries the board, counts; null without an axis, or if unknown.
 */
count: number | null, };

export type CalibrateOrder = { "target": "camera" } & CameraOrder | { "target": "hand_eye" } & HandEyeOrder | { "target": "laser_plane" } & LaserPlaneOrder | { "target": "pointer" } & PointerOrder | { "target": "axis" } & AxisOrder;

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
 * The record with that verdict.
 */
worst: string, 
/**
 * Root sum of squares of the errors that the records expect at the working distance, mm; null if one does not
 * state it.
 */
expected_mm: number | null, };

export type CalibrationFigures = { 
/**
 * Kind of calibration, as named in files.
 */
kind: string, 
/**
 * good, usable, badly determined or refused.
 */
verdict: string, 
/**
 * Reasons for the verdict.
 */
reasons: Array<string>, 
/**
 * Advice for the next picture.
 */
advice: Array<string>, 
/**
 * Figures by name, with the unit in the name.
 */
figures: Record<string, number>, 
/**
 * The same figures of the station's present calibration; empty if there is none.
 */
former: Record<string, number>, 
/**
 * Residual of each picture; the page's heading states the unit.
 */
per_picture: Array<[string, number]>, 
/**
 * Excluded pictures: name and reason.
 */
left_out: Array<[string, string]>, 
/**
 * It was stored in the station.
 */
accepted: boolean, };

export type CalibrationState = { 
/**
 * Name in files.
 */
kind: string, 
/**
 * Name for people.
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
 * Its age, days.
 */
days: number, 
/**
 * Expected error of a point at the working distance, mm.
 */
expected_mm: number | null, };

export type CameraFeature = { 
/**
 * Name of the feature by the standard naming convention.
 */
name: string, 
/**
 * Current value; null if it cannot be read.
 */
value: number | boolean | string | null, 
/**
 * us, dB, px, Hz; empty if it has none.
 */
unit: string, 
/**
 * Lowest and highest value; null: unknown.
 */
range: [number, number] | null, 
/**
 * The allowed values; empty if the feature is not an enumeration.
 */
words: Array<string>, 
/**
 * Whether it can be set now.
 */
writable: boolean, };

export type CameraOrder = { 
/**
 * Recording of a board
 */
recording: string, 
/**
 * Further recordings of the same camera, also of other boards
 */
more: Array<string>, 
/**
 * Frames that are not used, counted from 0 over all recordings
 */
leave_out: Array<number>, 
/**
 * Lens terms: evidence (what the pictures determine), none, one (k1), four (k1 k2 p1 p2), five (k3 too),
 * rational (and k4 k5 k6), prism (five and s1..s4), scheimpflug (k1 k2 k3 and tilt), all (OpenCV's 14)
 */
lens?: string | null, 
/**
 * Estimate the skew too; sensors with square rows have none
 */
skew: boolean, 
/**
 * Shape of the board: evidence (estimated if 8 or more pictures determine it), drawn (as drawn), shaped (always
 * estimated)
 */
board?: string | null, 
/**
 * Distance at which the expected error is judged, mm [default: middle of the working volume, else of the boards]
 */
working_mm?: number | null, 
/**
 * Channel of a colour picture: red, green, blue or luma
 */
channel?: string | null, };

export type CameraState = { 
/**
 * Its settings; empty if it has none, or while it is not connected.
 */
features: Array<CameraFeature>, };

export type CheckLine = { 
/**
 * station, camera, robot, gpu, disk or clock.
 */
group: string, 
/**
 * What was checked.
 */
name: string, 
/**
 * good, poor (works, but read the finding), bad or absent.
 */
state: string, 
/**
 * The finding, with the value and the limit.
 */
says: string, };

export type Confirmed = { 
/**
 * The job that proposes the motion.
 */
job: string, 
/**
 * `hash` of the motion that was shown.
 */
hash: string, };

export type Connection = { 
/**
 * mqtt: this program connects to a broker; modbus: PLCs connect to it.
 */
door: string, 
/**
 * Address of the broker, or the address that is listened on.
 */
address: string, 
/**
 * Why the door is not open; null if it is.
 */
problem: string | null, 
/**
 * The other programs that are connected now.
 */
peers: Array<string>, 
/**
 * Messages that were handed over, or frames that were answered, since the start.
 */
sent: number, 
/**
 * Messages that were not, because too many waited; frames, requests and connections that were refused.
 */
lost: number, 
/**
 * Growth of `sent` over the last ten seconds, 1/s.
 */
rate_hz: number, 
/**
 * The last problem or refusal; null if there was none.
 */
last_error: string | null, };

export type Distance = { 
/**
 * mm, or degrees for an angle.
 */
value: number, 
/**
 * Standard deviation, in the same unit.
 */
sigma: number, };

export type DrawingAsk = { 
/**
 * Name of the recipe.
 */
name: string, 
/**
 * ASCII DXF.
 */
text: string, 
/**
 * Unit if the drawing states none: mm, inch, cm, m, um, mil or foot; null: the unit stated in the drawing.
 */
unit?: string | null, 
/**
 * Layers that contain the part's edges; empty: all visible layers.
 */
layers: Array<string>, 
/**
 * The insertion datum in the drawing, in its unit; null: the middle of the largest outline's bounding box.
 */
origin?: [number, number] | null, 
/**
 * Number of rotations at which the part looks nearly alike.
 */
alike_turns: number, 
/**
 * Cell size of the map that is searched, mm.
 */
cell_mm: number, 
/**
 * Tolerance of the insertion in the plane, mm.
 */
tolerance_mm: number, 
/**
 * Tolerance of its rotation, degrees.
 */
tolerance_deg: number, 
/**
 * Distance of the tool above the insertion pose before and after the insertion, mm.
 */
approach_mm: number, 
/**
 * Replaces the station's recipe of that name.
 */
replace: boolean, };

export type DrawingRead = { 
/**
 * The recipe, as stored.
 */
recipe: RecipeText, 
/**
 * Width and height of the drawn part, mm.
 */
size_mm: [number, number], 
/**
 * What was skipped in the drawing, and what to check.
 */
notes: Array<string>, };

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
 * The robot's state for motions.
 */
motion: MotionState, } } | { "event": "bar", "data": Bar } | { "event": "job", "data": Job } | { "event": "motion", "data": MotionState } | { "event": "gone", "data": string };

export type ExposureSet = { 
/**
 * The exposure that was set, us.
 */
exposure_us: number, 
/**
 * Exposures tried: us, and the level of the stripe's peaks, fraction of full scale; null: no stripe.
 */
tried: Array<[number, number | null]>, 
/**
 * Measures of the pictures now.
 */
look: PictureLook, 
/**
 * If no exposure is quite right: why this one is the best.
 */
remark: string | null, };

export type Filter = { "filter": "sigma", 
/**
 * Largest standard deviation, mm.
 */
most_mm: number, } | { "filter": "heights", 
/**
 * Lowest height, mm.
 */
low_mm: number, 
/**
 * Highest height, mm.
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
 * Pieces with fewer cells are removed.
 */
least_cells: number, 
/**
 * Neighbouring cells whose heights differ by more belong to different pieces, mm.
 */
step_mm: number, };

export type FilterOrder = { 
/**
 * Folder from sheetlight scan --out; over HTTP the name of its job
 */
scan: string, 
/**
 * Filter: sigma:MM, heights:LOW,HIGH, cut:X0,Y0,X1,Y1, keep:X0,Y0,X1,Y1 or islands:CELLS,STEP; may be repeated
 */
filters: Array<Filter>, };

export type Filtered = { 
/**
 * In the order in which they are applied.
 */
filters: Array<Filter>, 
/**
 * Number of cells that each filter removes.
 */
cells: Array<number>, 
/**
 * Number of cells that remain.
 */
left: number, };

export type Filters = { 
/**
 * In the order in which they are applied.
 */
filters: Array<Filter>, };

export type FindOrder = { 
/**
 * Scans of one part, from one or several sides: folders from sheetlight scan --out; over HTTP names of jobs
 */
scans: Array<string>, 
/**
 * Recording of the pointer's spot on plain surfaces of the part, with robot poses; checks the height
 */
range?: string | null, 
/**
 * Recipe (TOML) of the part; over HTTP its name
 */
recipe: string, 
/**
 * Notation of the poses: denso, ur, kuka, ... (docs/conventions.md) [default: the station's, else matrix]
 */
robot?: string | null, 
/**
 * Direction towards the camera, base frame [default: from the station, else 0,0,1]
 */
up?: [number, number, number] | null, 
/**
 * Two places in the first scan's map, mm: the tool goes to the middle of the pins there [default: to the point
 * that the recipe names]
 */
pins?: [[number, number], [number, number]] | null, 
/**
 * List every match, not only the best
 */
all: boolean, };

export type Fit = { 
/**
 * Start and end along the section, mm.
 */
piece: [number, number], 
/**
 * Height at its middle, mm.
 */
height_mm: number, 
/**
 * Standard deviation of the height, mm.
 */
height_sigma_mm: number, 
/**
 * Its angle to the grid's plane, degrees.
 */
angle_deg: number, 
/**
 * Standard deviation of the angle, degrees.
 */
angle_sigma_deg: number, 
/**
 * Distance of the points from the line, rms, mm.
 */
rms_mm: number, 
/**
 * Number of points in the fit.
 */
places: number, };

export type FrameInfo = { 
/**
 * tool or camera.
 */
name: string, 
/**
 * The frame it is relative to: flange or base.
 */
on: string, 
/**
 * Labels of the numbers.
 */
labels: Array<string>, 
/**
 * mm, degrees, or units of the convention.
 */
numbers: Array<number>, };

export type Frames = { 
/**
 * Passed to the processing stages.
 */
seen: number, 
/**
 * With at least one point.
 */
measured: number, 
/**
 * Frames without a result, by cause.
 */
dropped: Record<string, number>, };

export type GateLight = { 
/**
 * The judged quantity, with its unit.
 */
name: string, 
/**
 * The measured value.
 */
value: number, 
/**
 * The limit.
 */
limit: number, 
/**
 * The value keeps the limit.
 */
passed: boolean, };

export type Ghost = { 
/**
 * Number of the picture that they belong to.
 */
number: number, 
/**
 * u and v, px; lines end where they leave the lens's field of view.
 */
lines: Array<Array<[number, number]>>, 
/**
 * How far the arm's motion between the pose readings before and after the picture shifts the outlines, px; 0:
 * the arm stood still.
 */
moved_px: number, };

export type Grant = { 
/**
 * The name under which the confirmation is redeemed once.
 */
grant: string, };

export type HandEyeOrder = { 
/**
 * Recording of one board that stands still, or is carried by the flange, with a picture and a pose per frame
 */
recording?: string | null, 
/**
 * Frames that are not used, counted from 0
 */
leave_out: Array<number>, 
/**
 * Pose file of the recording, without extension [default: the one in meta.json]; with board poses a path
 */
poses?: string | null, 
/**
 * Board poses (camera_T_board, docs/file-formats.md) instead of pictures
 */
board_poses?: string | null, 
/**
 * Sigma of the board poses' position per axis, mm [default: included in the robot's]
 */
board_sigma_mm?: number | null, 
/**
 * Sigma of the board poses' orientation per axis, degrees
 */
board_sigma_deg?: number | null, 
/**
 * Where the camera is: eye-in-hand (on the flange) or eye-to-hand (fixed) [default: the station's, else
 * eye-in-hand with a note]
 */
mount?: string | null, 
/**
 * Sigma of the robot's position per axis, mm [default: estimated]
 */
robot_sigma_mm?: number | null, 
/**
 * Sigma of the robot's orientation per axis, degrees [default: estimated]
 */
robot_sigma_deg?: number | null, 
/**
 * Distance at which the expected error is stated, mm [default: middle of the working volume, else of the boards]
 */
working_mm?: number | null, 
/**
 * Channel of a colour picture: red, green, blue or luma
 */
channel?: string | null, };

export type InTheCell = { 
/**
 * Puts the component of this part into the gripper; null: the gripper keeps its component.
 */
holds?: string | null, 
/**
 * Jogs the arm over the calibration board; false: over the part.
 */
over_board: boolean, };

export type InsertOrder = { 
/**
 * Recipe (TOML) of the part; over HTTP its name
 */
recipe: string, 
/**
 * Sweep length centred on the picture, mm [default: the part and an eighth of the field's short side at both
 * ends]
 */
sweep_mm?: number | null, 
/**
 * Speed of every motion, mm/s [default: the station's]
 */
speed_mm_s?: number | null, 
/**
 * Notation in which poses are shown [default: the station's, else denso]
 */
notation?: string | null, 
/**
 * Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
 */
on?: string | null, 
/**
 * Largest angle between the touched board and the found part, degrees [default: 3]
 */
max_tilt_deg?: number | null, 
/**
 * After an interruption, retract instead of continuing
 */
back_out: boolean, };

export type Inserted = { 
/**
 * Time from the start to the confirmed position, s.
 */
time_to_position_s: number | null, 
/**
 * Number of confirmations until then.
 */
confirmations_to_position: number | null, 
/**
 * Total duration, work and waiting, s.
 */
seconds: number, 
/**
 * Number of confirmations in total.
 */
confirmations: number, 
/**
 * The found part; null if it was found before the program was restarted.
 */
found: Position | null, };

export type Job = { 
/**
 * Version of job.json: 1.
 */
format: number, 
/**
 * Name of the job's folder, e.g. `0007-scan`.
 */
id: string, 
/**
 * What was ordered.
 */
order: Order, 
/**
 * State of the job.
 */
state: JobState, 
/**
 * Steps done (shots, pictures, checks).
 */
done: number, 
/**
 * Steps in total; null while unknown.
 */
of: number | null, 
/**
 * When it was ordered.
 */
created: string, 
/**
 * Run time, s.
 */
seconds: number, 
/**
 * Why it failed.
 */
problem: Problem | null, 
/**
 * The result.
 */
outcome: Outcome | null, 
/**
 * Steps of an interrupted run are stored: resuming continues from them.
 */
resumable: boolean, };

export type JobState = "queued" | "running" | "done" | "failed" | "stopped" | "cut_off";

export type JointOrder = { 
/**
 * Recordings of boards
 */
recordings: Array<string>, 
/**
 * Pose file of the recordings with robot poses, without extension [default: the one in meta.json]
 */
poses?: string | null, 
/**
 * Where the camera is: eye-in-hand (on the flange) or eye-to-hand (fixed) [default: the station's, else
 * eye-in-hand with a note]
 */
mount?: string | null, 
/**
 * Nearest and farthest depth of the stated error, mm [default: the working volume, else where boards were lit]
 */
working_mm?: Array<number> | null, 
/**
 * Channel of a colour picture: red, green, blue or luma
 */
channel?: string | null, 
/**
 * Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
 */
on?: string | null, };

export type KeptUp = { 
/**
 * Adapter or processor.
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
 * Frame rate at which pictures were sent, Hz.
 */
rate_hz: number, 
/**
 * Number of pictures sent.
 */
sent: number, 
/**
 * Number of these that have points.
 */
measured: number, 
/**
 * Skipped because a newer one had arrived.
 */
passed_over: number, 
/**
 * Lost for other reasons.
 */
lost: number, 
/**
 * Time from the last byte to the points, p50 and p99, ms.
 */
ms: [number, number], };

export type Knock = { 
/**
 * The token of this program start.
 */
token: string | null, 
/**
 * The password, if the screen is served to other machines.
 */
password: string | null, };

export type LaserPlaneOrder = { 
/**
 * Recording with an ambient and a laser picture per frame
 */
recording: string, 
/**
 * Frames that are not used, counted from 0
 */
leave_out: Array<number>, 
/**
 * Nearest depth at which the result is judged, mm [default: station.toml's, else where boards were lit]
 */
near_mm?: number | null, 
/**
 * Farthest depth at which the result is judged, mm
 */
far_mm?: number | null, 
/**
 * Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
 */
on?: string | null, 
/**
 * Channel of a colour picture: red, green, blue or luma
 */
channel?: string | null, };

export type Lease = { 
/**
 * A short name of the tab that holds the lease; null: no tab holds it.
 */
holder: string | null, 
/**
 * Seconds until the lease expires.
 */
seconds_left: number, };

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
 * Cell size, mm; the centre of cell (i, j) is at ((i + 0.5) cell, (j + 0.5) cell).
 */
cell_mm: number, 
/**
 * Pose of the grid in the cloud's frame: row-major 4x4, mm.
 */
base_from_grid: [number, number, number, number, number, number, number, number, number, number, number, number, number, number, number, number], 
/**
 * Range that contains 99 % of the heights, mm.
 */
z_mm: [number, number], 
/**
 * The same for the standard deviation, mm.
 */
sigma_mm: [number, number], 
/**
 * The same for the stripe's amplitude, grey levels.
 */
intensity: [number, number], };

export type Measure = { "measure": "two_points" } & PointsAsk | { "measure": "point_to_plane" } & PlaneAsk;

export type MeasureAnswer = { 
/**
 * The distance, mm; positive for a point above its plane.
 */
distance: Distance, 
/**
 * Components along x, y, z of the grid, mm; only for two points.
 */
along: [number, number, number] | null, 
/**
 * Tilt of the plane relative to the grid, degrees.
 */
tilt: Distance | null, 
/**
 * Distance of the plane's cells from it, rms, mm.
 */
rms_mm: number | null, 
/**
 * Number of cells used.
 */
cells: number, };

export type Mode = "live" | "replay" | "simulated";

export type MotionState = { 
/**
 * A robot is configured.
 */
robot: boolean, 
/**
 * The program was started with permission to move it.
 */
may_move: boolean, 
/**
 * A short name of the tab that armed the robot; null: it is not armed.
 */
armed: string | null, 
/**
 * A confirmed motion is under way.
 */
moving: boolean, 
/**
 * Why a person must look at the robot first; null: nobody must.
 */
look: string | null, 
/**
 * The job that moves the robot, or the last one that did.
 */
job: string | null, 
/**
 * The motion that waits for confirmation.
 */
asked: Asked | null, 
/**
 * Messages of the job so far.
 */
said: Array<string>, 
/**
 * Longest silence of the held button during the last motion, ms; null: there was no motion.
 */
silence_ms: number | null, 
/**
 * For a calibration: number of stops, and the error expected after them, mm.
 */
expected: Array<[number, number]>, 
/**
 * Null if the robot is not the simulated one.
 */
simulated: SimulatedCell | null, };

export type NewPoint = { 
/**
 * The name by which later points and the insertion refer to it.
 */
name: string, 
/**
 * midpoint, line, intersection, offset or lattice.
 */
kind: string, 
/**
 * Names of shapes, or of earlier points.
 */
of: Array<string>, 
/**
 * For an offset: the line or lattice that gives the direction.
 */
along?: string | null, 
/**
 * For an offset: distance along and across that direction, mm.
 */
by_mm?: [number, number] | null, };

export type Notation = { 
/**
 * Name of the convention.
 */
name: string, 
/**
 * One label per number, with its unit.
 */
labels: Array<string>, 
/**
 * In the order of the labels.
 */
numbers: Array<number>, };

export type Order = { "procedure": "check" } & Plain | { "procedure": "scan" } & ScanOrder | { "procedure": "filter" } & FilterOrder | { "procedure": "find" } & FindOrder | { "procedure": "teach" } & TeachOrder | { "procedure": "touch" } & TouchOrder | { "procedure": "tune" } & Plain | { "procedure": "calibrate" } & CalibrateOrder | { "procedure": "joint" } & JointOrder | { "procedure": "auto" } & AutoOrder | { "procedure": "insert" } & InsertOrder | { "procedure": "benchmark" } & BenchmarkOrder;

export type Outcome = { "procedure": "check", 
/**
 * In the order of the checks.
 */
lines: Array<CheckLine>, } | { "procedure": "scan" } & ScanFigures | { "procedure": "find" } & Position | { "procedure": "teach", 
/**
 * Name of the recipe.
 */
recipe: string, 
/**
 * Result of finding the part in that scan.
 */
proof: Position, } | { "procedure": "touch" } & Touched | { "procedure": "tune" } & ExposureSet | { "procedure": "calibrate" } & CalibrationFigures | { "procedure": "joint" } & CalibrationFigures | { "procedure": "auto" } & CalibrationFigures | { "procedure": "insert" } & Inserted | { "procedure": "benchmark", 
/**
 * One row per size and processor.
 */
rows: Array<BenchRow>, 
/**
 * Recorded rows of other machines.
 */
recorded: Array<BenchRow>, 
/**
 * Measured and dropped pictures of a camera, at half and at full resolution.
 */
kept_up: Array<KeptUp>, };

export type Outlines = { 
/**
 * Frame of the scan: base, axis, flange or map.
 */
frame: string, 
/**
 * One line per shape, x y z in that frame, mm; closed lines end at their first point.
 */
lines: Array<Array<[number, number, number]>>, };

export type OutputAsk = { 
/**
 * line, pointer or room: on for a moment; open or close: the gripper.
 */
output: string, };

export type Pace = { 
/**
 * mm/s.
 */
speed_mm_s: number, 
/**
 * Distance between shots, mm.
 */
step_mm: number, 
/**
 * Frame rate, Hz.
 */
rate_hz: number, 
/**
 * Duration over the whole length, s.
 */
seconds: number, 
/**
 * camera, chain or speed: the limiting one; null: none is known.
 */
limited_by: string | null, 
/**
 * The highest speed that each of them allows at this step, mm/s.
 */
bears: Array<[string, number]>, 
/**
 * The step that results at this speed, mm.
 */
left_step_mm: number, };

export type PictureLook = { 
/**
 * Lowest, median, 99th percentile and highest grey level.
 */
levels: [number, number, number, number], 
/**
 * Fraction of saturated pixels.
 */
saturated: number, 
/**
 * Null if no stripe is visible.
 */
stripe: StripeSeen | null, };

export type PictureRef = { 
/**
 * The recording.
 */
recording: string, 
/**
 * Frame number, counted from 0.
 */
frame: number, 
/**
 * laser or ambient; null: whichever exists.
 */
light: string | null, 
/**
 * Columns of the answer, 16 to 4096; null: as the picture.
 */
width: number | null, };

export type Plain = Record<string, never>;

export type PlaneAsk = { 
/**
 * The point, mm in the grid.
 */
point: [number, number], 
/**
 * Corners of the box to whose surface the plane is fitted: x0 y0 x1 y1, mm in the grid.
 */
plane: [number, number, number, number], };

export type PointChange = { "add": NewPoint } | { "take_out": { 
/**
 * Name of the point.
 */
name: string, } } | { "choose": { 
/**
 * Name of the point; null: the part's datum.
 */
name: string | null, } };

export type PointerOrder = { 
/**
 * Recording with an ambient and a laser picture per frame
 */
recording: string, 
/**
 * Frames that are not used, counted from 0
 */
leave_out: Array<number>, 
/**
 * Nearest depth at which the result is judged, mm [default: station.toml's, else where spots were]
 */
near_mm?: number | null, 
/**
 * Farthest depth at which the result is judged, mm
 */
far_mm?: number | null, 
/**
 * Channel of a colour picture: red, green, blue or luma
 */
channel?: string | null, };

export type PointsAsk = { 
/**
 * First point, mm in the grid.
 */
a: [number, number], 
/**
 * Second point, mm in the grid.
 */
b: [number, number], };

export type PointsChange = { 
/**
 * TOML; it need not be stored.
 */
text: string, 
/**
 * The change.
 */
change: PointChange, };

export type PointsChanged = { 
/**
 * TOML, with all its comments.
 */
text: string, 
/**
 * Its points after the change.
 */
points: Array<RecipePoint>, };

export type PointsOf = { 
/**
 * TOML.
 */
text: string, };

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
 * Every gate passed.
 */
passed: boolean, 
/**
 * The gates that failed, in words.
 */
reasons: Array<string>, 
/**
 * Null if a gate failed.
 */
poses: RobotPoses | null, 
/**
 * Standard deviation along x, y, z of the part, mm.
 */
sigma_mm: [number, number, number], 
/**
 * Standard deviation of the rotation about these axes, degrees.
 */
sigma_deg: [number, number, number], 
/**
 * Tolerance of the insertion in the plane, mm.
 */
tolerance_mm: number, 
/**
 * Tolerance of its rotation, degrees.
 */
tolerance_deg: number, 
/**
 * 3 sigma lie within both tolerances.
 */
within_tolerance: boolean, 
/**
 * Contributions to the standard deviation.
 */
terms: Array<Term>, 
/**
 * False: a contribution is unknown, so the sum is a lower bound.
 */
complete: boolean, 
/**
 * Each gate with its value and limit.
 */
gates: Array<GateLight>, 
/**
 * Score of the match.
 */
score: number, 
/**
 * Score of the next best pose.
 */
second_score: number, 
/**
 * Pose of the part in the scan's frame: row-major 4x4, mm.
 */
part: [number, number, number, number, number, number, number, number, number, number, number, number, number, number, number, number], 
/**
 * Outlines of the drawing in the height map's grid, mm.
 */
outline: Array<Array<[number, number]>>, 
/**
 * What else a reader must know.
 */
notes: Array<string>, };

export type Problem = { 
/**
 * usage, input, refused, output or device.
 */
kind: string, 
/**
 * What happened, with the value and the limit.
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

export type RecipeAsk = { 
/**
 * TOML.
 */
text: string, 
/**
 * Replaces the station's recipe of that name.
 */
replace: boolean, };

export type RecipePoint = { 
/**
 * The name by which constructions and the insertion refer to it.
 */
name: string, 
/**
 * Position in the part's frame, as drawn, mm.
 */
at: [number, number], 
/**
 * shape, grid, or the kind of construction: midpoint, line, intersection, offset, lattice.
 */
kind: string, 
/**
 * The tool goes to this point.
 */
chosen: boolean, };

export type RecipeText = { 
/**
 * Name of the file, without extension.
 */
name: string, 
/**
 * Name of the part for people; read from the text.
 */
title: string, 
/**
 * The recipe ships with the program; it is copied when it is changed.
 */
shipped: boolean, 
/**
 * TOML; empty if the file cannot be read at all.
 */
text: string, 
/**
 * What is wrong with it; null: nothing.
 */
problem: Problem | null, };

export type RecordingInfo = { 
/**
 * Path below the recordings' folder.
 */
name: string, 
/**
 * The name stated in its meta.json.
 */
set: string, 
/**
 * Number of frames.
 */
frames: number, 
/**
 * Columns of its pictures, px.
 */
width: number, 
/**
 * Rows, px.
 */
height: number, 
/**
 * line or pointer; null if no laser is on.
 */
beam: string | null, 
/**
 * It shows a calibration board.
 */
board: boolean, 
/**
 * robot, linear or turntable.
 */
motion: string, 
/**
 * The procedures that it suits: scan, touch, joint, or targets of a calibration.
 */
suits: Array<string>, 
/**
 * Why it cannot be used; null: it can.
 */
problem: Problem | null, };

export type Redeem = { 
/**
 * The grant that pressing the button returned.
 */
grant: string, 
/**
 * The confirmed motion again.
 */
what: Confirmed, };

export type Repeats = { 
/**
 * Number of poses.
 */
places: number, 
/**
 * For x, y, z and rotation; empty for fewer than two poses.
 */
along: Array<Spread>, };

export type RepeatsAsk = { 
/**
 * Names of the jobs.
 */
jobs: Array<string>, };

export type RobotPoses = { 
/**
 * Hash of all numbers here: a confirmation identifies the shown poses by it.
 */
hash: string, 
/**
 * The station's pose convention.
 */
convention: string, 
/**
 * One label per number, with its unit.
 */
labels: Array<string>, 
/**
 * Above the insertion.
 */
approach: Array<number>, 
/**
 * The inserted tool.
 */
insertion: Array<number>, 
/**
 * Above the insertion, on the way back.
 */
retract: Array<number>, 
/**
 * The insertion pose in every convention.
 */
notations: Array<Notation>, };

export type RobotState = "no_link" | "read_only" | "armed" | "moving";

export type ScanFigures = { 
/**
 * Shots processed, skipped ones included.
 */
shots: number, 
/**
 * Number of points in the cloud.
 */
points: number, 
/**
 * Columns of the pictures, px.
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
 * Median of the points' standard deviations, mm.
 */
median_sigma_mm: number | null, 
/**
 * Fraction of the map's cells that were measured.
 */
coverage: number | null, 
/**
 * Cell size, mm.
 */
cell_mm: number | null, 
/**
 * Range that contains 98 % of the map's heights, mm.
 */
z_mm: [number, number] | null, 
/**
 * Number of peaks by `fate`: kept, or the reason for rejection.
 */
peaks: Record<string, number>, 
/**
 * Number of shots without a point.
 */
dark_shots: number, 
/**
 * Skipped shots: name and reason.
 */
skipped: Array<[string, string]>, 
/**
 * Time from the first shot to the finished cloud, s.
 */
seconds: number, 
/**
 * Shots per second of this run.
 */
shots_per_second: number, 
/**
 * The adapter; or this machine's processor, and why.
 */
ran_on: string, 
/**
 * Seconds by activity of the main thread.
 */
spent: Record<string, number>, 
/**
 * What a reader must know.
 */
remarks: Array<string>, };

export type ScanOrder = { 
/**
 * Recording folder with meta.json
 */
recording: string, 
/**
 * Pose file of the recording, without extension [default: the one in meta.json]
 */
poses?: string | null, 
/**
 * Channel of a colour picture: red, green, blue or luma
 */
channel?: string | null, 
/**
 * Picture with the laser off at the shots' exposure, to subtract: in the recording, or a path; once per exposure
 */
ambient?: Array<string>, 
/**
 * Use exposure N of a recording with several, 1 is the shortest, instead of merging all
 */
exposure?: number | null, 
/**
 * Where the stages run: auto (a hardware GPU, else the processor), gpu or cpu
 */
on?: string | null, 
/**
 * Cell of the height map, mm [default: about 1.5 points per cell]
 */
cell_mm?: number | null, 
/**
 * Exclude shots that cannot be read, and list them
 */
skip_bad: boolean, 
/**
 * Settings that differ from the station's: dotted keys of the section extraction in station.toml, and their values
 */
settings: Record<string, unknown>, };

export type Section = { 
/**
 * Its length, mm.
 */
length_mm: number, 
/**
 * One point per half cell.
 */
points: Array<SectionPoint>, 
/**
 * One fit per piece.
 */
fits: Array<Fit>, 
/**
 * Height of the second piece's middle above the first piece's line, mm; only with two pieces.
 */
step: Distance | null, 
/**
 * Angle between the two lines, degrees.
 */
angle: Distance | null, };

export type SectionAsk = { 
/**
 * Start, mm.
 */
from: [number, number], 
/**
 * End, mm.
 */
to: [number, number], 
/**
 * Pieces of the section to which lines are fitted: start and end along the section, mm; at most two.
 */
fits: Array<[number, number]>, };

export type SectionPoint = { 
/**
 * Distance along the section, mm.
 */
s: number, 
/**
 * Height, mm; null if nothing was measured.
 */
z: number | null, 
/**
 * Its standard deviation, mm.
 */
sigma: number | null, };

export type Session = { 
/**
 * A short name of the tab that sent the request.
 */
tab: string, };

export type SetFeature = { 
/**
 * Name of the feature by the standard naming convention, e.g. ExposureTime.
 */
name: string, 
/**
 * The value as text.
 */
value: string, };

export type SettingsAsk = { 
/**
 * SHA-256 of the text that this change was made from.
 */
sha256: string, 
/**
 * A new station.toml.
 */
text?: string | null, 
/**
 * Settings by their dotted names; null removes one. Comments and all other settings stay.
 */
changes: Record<string, unknown>, };

export type SettingsState = { 
/**
 * The text of station.toml.
 */
text: string, 
/**
 * SHA-256 of the text: a change names the text that it was made from.
 */
sha256: string, 
/**
 * The settings by their dotted names; empty if the text cannot be read.
 */
values: Record<string, unknown>, 
/**
 * Available pose conventions.
 */
notations: Array<string>, 
/**
 * The station's folder on the machine that serves the screen.
 */
folder: string, 
/**
 * The folder that contains the recordings.
 */
recordings: string, 
/**
 * Other machines may open the screen, with the password.
 */
secured: boolean, 
/**
 * Links to other programs that were named when the program was started.
 */
connections: Array<Connection>, 
/**
 * Newest first.
 */
backups: Array<BackupInfo>, };

export type SimulatedCell = { 
/**
 * Parts that have a component for the gripper.
 */
parts: Array<string>, 
/**
 * The part whose component the gripper holds.
 */
holds: string, 
/**
 * True: the arm is over the calibration board; false: over the part.
 */
over_board: boolean, };

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
 * Standard deviation of the poses.
 */
scatter: number, 
/**
 * Root mean square of the standard deviations that the poses state.
 */
stated: number, 
/**
 * Range from the lowest to the highest value.
 */
apart: number, 
/**
 * Half width of the histogram, centred on the median.
 */
half: number, 
/**
 * Number of poses in each bar of the histogram.
 */
bars: Array<number>, };

export type SquareProposed = { 
/**
 * Tilt of the tool in the last shot, degrees.
 */
tilt_deg: number, 
/**
 * Standard deviation of the tilt, degrees.
 */
tilt_sigma_deg: number, 
/**
 * The robot's pose convention.
 */
convention: string, 
/**
 * Labels of the numbers.
 */
labels: Array<string>, 
/**
 * Pose of the flange, base frame.
 */
flange: Array<number>, 
/**
 * Pose of the tool then, base frame.
 */
tool: Array<number>, };

export type StationInfo = { 
/**
 * Its name.
 */
name: string, 
/**
 * Source of the pictures.
 */
mode: Mode, 
/**
 * Name and version of the program.
 */
program: string, 
/**
 * The robot's pose convention; null: poses are written as matrices.
 */
robot: string | null, 
/**
 * eye-in-hand or eye-to-hand; null: not stated.
 */
mount: string | null, 
/**
 * Tolerance of the work, mm.
 */
tolerance_mm: number | null, 
/**
 * Range of camera depths in which points are accepted, mm.
 */
volume_mm: [number, number] | null, 
/**
 * Frame of scans and of poses found in them: base, axis or camera.
 */
work_frame: string, 
/**
 * Fixed frames relative to others, in the robot's convention.
 */
frames: Array<FrameInfo>, 
/**
 * One entry per existing calibration.
 */
calibrations: Array<CalibrationState>, 
/**
 * What is wrong with the station; null: nothing.
 */
problem: Problem | null, 
/**
 * Dotted names of all extraction settings, with the station's values.
 */
extraction: Record<string, unknown>, };

export type StripeSeen = { 
/**
 * The stripe is horizontal, so it is measured column by column.
 */
lying: boolean, 
/**
 * Level that 5 % of its peaks exceed, fraction of full scale.
 */
peak: number, 
/**
 * Range in which `peak` should lie.
 */
wanted: [number, number], 
/**
 * Fraction of its peaks that are saturated.
 */
saturated: number, 
/**
 * Full width at half maximum, px, median.
 */
width_px: number, 
/**
 * Its peak relative to the level beside it, median.
 */
contrast: number, 
/**
 * Fraction of the lines without a stripe.
 */
dark: number, 
/**
 * The exposure is right.
 */
right: boolean, 
/**
 * The same for pieces along the stripe, from the left or the top: peak, width in px, contrast, dark fraction.
 * The first three are 0 where the stripe is dark.
 */
pieces: Array<[number, number, number, number]>, };

export type SupportAsk = { 
/**
 * A person ticked the option.
 */
pictures: boolean, };

export type SurfaceTouched = { 
/**
 * Unit normal towards the camera; base frame.
 */
normal: [number, number, number], 
/**
 * Middle of the spots, base frame, mm.
 */
centre_mm: [number, number, number], 
/**
 * Standard deviation of its tilt: in the worst direction, and at right angles to it, degrees.
 */
tilt_sigma_deg: [number, number], 
/**
 * Distance of the spots from the plane, rms, mm.
 */
rms_mm: number, 
/**
 * Angle between its normal and the base's z axis, degrees.
 */
tilt_deg: number, 
/**
 * A spot that was excluded because it does not lie on the plane of the others.
 */
left_out: string | null, };

export type SweepAsk = { 
/**
 * Name of the recipe.
 */
recipe: string, 
/**
 * Name of an insertion job that has already touched the board.
 */
job?: string | null, 
/**
 * Distance from the camera to the board, mm, before it was touched.
 */
distance_mm?: number | null, 
/**
 * Length of the sweep, mm.
 */
sweep_mm?: number | null, 
/**
 * Distance between shots, mm.
 */
step_mm?: number | null, 
/**
 * Speed, mm/s; null: the highest that camera, chain and station allow.
 */
speed_mm_s?: number | null, 
/**
 * Frame rate of another camera than the connected one, Hz.
 */
camera_hz?: number | null, };

export type SweepPlan = { 
/**
 * Name of the recipe.
 */
recipe: string, 
/**
 * True: the board was touched; false: it is assumed to be square to the camera.
 */
touched: boolean, 
/**
 * Distance from the board to the camera, mm.
 */
depth_mm: number, 
/**
 * Distance from the first shot's stripe to the last one's, mm.
 */
length_mm: number, 
/**
 * Distance between shots, mm.
 */
step_mm: number, 
/**
 * Number of pictures.
 */
shots: number, 
/**
 * Size of the part in any rotation: the diagonal of its drawing, mm.
 */
part_mm: number, 
/**
 * The camera's field of view on the board: x0 y0 x1 y1, mm.
 */
field_mm: [number, number, number, number], 
/**
 * The corners of the swept area in order: the ends of the first shot's stripe, then of the last one's, mm.
 */
swept_mm: [[number, number], [number, number], [number, number], [number, number]], 
/**
 * Largest offset of the part from the picture's middle along the sweep, mm; negative: it is never swept
 * completely.
 */
along_mm: number, 
/**
 * The same across the sweep, along the stripe.
 */
across_mm: number, 
/**
 * Reserve of the working volume above and below the board, mm; null: unknown.
 */
volume_mm: [number, number] | null, 
/**
 * Distance of the flange from the sides of its box, mm; negative: outside; null: no box is stated, or the
 * robot's pose is unknown.
 */
box_mm: number | null, 
/**
 * Labels of a flange pose's numbers.
 */
labels: Array<string>, 
/**
 * Poses of the flange at the first and the last shot; empty if the robot's pose is unknown.
 */
flange: Array<Array<number>>, 
/**
 * The swept area, and the extent of a part in its middle, in the camera's present picture, px; empty: unknown.
 */
seen_px: Array<Array<[number, number]>>, 
/**
 * Frame rate of the camera, Hz; null: unknown.
 */
camera_hz: number | null, 
/**
 * Rate at which a scan of this station measured pictures of this size, Hz; null: no scan did.
 */
chain_hz: number | null, 
/**
 * The station's speed limit, mm/s.
 */
limit_mm_s: number | null, 
/**
 * Pace of a scan that does not stop for its pictures; null: no limit is known.
 */
pace: Pace | null, };

export type TakeLease = { 
/**
 * Takes it even if another tab operates.
 */
firmly: boolean, };

export type TeachOrder = { 
/**
 * The job that scanned it.
 */
scan: string, 
/**
 * Name of the recipe.
 */
name: string, 
/**
 * Corners of the body before its rotation: x0 y0 x1 y1, mm in the grid.
 */
outline: [number, number, number, number], 
/**
 * Its rotation about its centre, degrees.
 */
angle_deg: number, 
/**
 * Windows in the body, corners as for `outline`.
 */
windows: Array<[number, number, number, number]>, 
/**
 * Round holes: x, y, radius.
 */
holes: Array<[number, number, number]>, 
/**
 * Tolerance of the insertion in the plane, mm.
 */
tolerance_mm: number, 
/**
 * Tolerance of its rotation, degrees.
 */
tolerance_deg: number, 
/**
 * Distance of the tool above the insertion pose before and after the insertion, mm.
 */
approach_mm: number, 
/**
 * Replaces the station's recipe of that name.
 */
replace: boolean, };

export type Term = { 
/**
 * Name of the contribution.
 */
name: string, 
/**
 * Standard deviation along x, y, z of the part, mm; null if unknown.
 */
sigma_mm: [number, number, number] | null, 
/**
 * Standard deviation about these axes, degrees.
 */
sigma_deg: [number, number, number] | null, 
/**
 * Explanation.
 */
note: string, };

export type TouchOrder = { 
/**
 * Recording with a laser picture of the pointer's spot per frame
 */
recording: string, 
/**
 * Pose file of the recording, without extension [default: the one in meta.json]
 */
poses?: string | null, };

export type Touched = { 
/**
 * For each spot: picture, distance from the camera along its axis and its standard deviation, mm.
 */
spots: Array<[string, number, number]>, 
/**
 * The plane through the spots.
 */
surface: SurfaceTouched | null, 
/**
 * How to make the tool square to the plane; null without a plane or without the station's tool.
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

export type ViewRef = { 
/**
 * The recording.
 */
recording: string, 
/**
 * Frame number, counted from 0.
 */
frame: number, };
