//! End to end, one question a file. Every test drives the `armcal` program as a user would.

#![allow(
    clippy::print_stdout,
    clippy::print_stderr,
    reason = "a test says what it measured and what it skipped"
)]

mod support;

/// Do the crates, and the rooms of each, lean on each other one way?
mod architecture;

/// Does the main job on the shipped fixtures give the paper's picture, and points the fit never saw?
mod paper_rig;

/// Does geometry alone bring real robots as far as independent solvers bring them?
mod real_robots;

/// Is a pipeline proposed from recordings alone as good as one written by hand, and honest about what it could not see?
mod init;

/// Do results of a finished run stand for its pipeline, to the same numbers, and only where they are of the same inputs?
mod finished_results;

/// Are joints and bodies found inside messages of types that nobody told armcal?
mod init_fields;
mod init_mends;

/// Does the verdict obey its laws on real arms, whatever noise is declared?
mod laws;

/// Does a proposed pipeline take every tracked body for what it is?
mod init_roles;

/// Does armcal say of every symptom what the page of symptoms says it does?
mod symptoms;

/// Does every shipped pipeline run, from a clone or with the data that it names?
mod shipped_pipelines;

/// Are databases of rosbag2, bags of ROS 1 and compressed recordings read as they are, to the same numbers as MCAP?
mod bags;

/// Do the tables that labs publish end in the calibration of their session, whatever their form?
mod tables;

/// Does every command say so where a recording that it reads has lost data, and is nothing reused that was made of less?
mod damaged_inputs;

/// Is every file of the MCAP project's conformance corpus read, whole or cut anywhere?
mod mcap_conformance;

/// Does every kind of damage to a recording cost exactly what it must, and is that said?
mod corrupt_recordings;

/// Are results whole whatever happens to the disk, the folder or the process?
mod write_faults;

/// Is every call that the system refuses a command harmless, or reported with the file that it was about?
#[cfg(target_os = "linux")]
mod fault_sweep;

/// Is nothing written over that a command was given, or that armcal did not make?
mod sacred_inputs;

/// Is everything that is no file named and not waited for, wherever a file is read or written?
mod bad_paths;

/// Do names out of a recording stay names?
mod hostile_names;

/// Do files that people write, however wrong, end in words?
mod fuzzed_files;

/// Does bad input give a clear error or a counted warning, and never half a file?
mod bad_input;

/// Do the outputs open in the Python `mcap` package, and does scipy find the same optimum?
mod python_agrees;

/// Does the same input give the same bytes, whatever the number of threads?
mod deterministic;

/// Are trees of links, joints that follow others, and what all of it weighs what an independent library makes of them?
mod urdf_trees;

/// Are all dwells of fresh simulated rigs associated rightly, and intervals honest?
mod many_rigs;

/// Does a joint without a measured effort, a load anywhere, a link without a mass cost what it must, and is it told by name?
mod effort_and_loads;

/// Does the tool learn from a recording which effect is missing, and does adding it help on unseen points?
mod missing_effect;

/// Does a change of the code move a number that it is not meant to move?
mod goldens;

/// Does `summary.json` keep every field that programs read?
mod summary_contract;

/// Is nobody told that nothing is missing where a number of the pipeline, model or board is wrong?
mod verdict_law;

/// Do names hold on the rig as another physics engine moves it?
mod another_engine;

/// Are mistakes of the setup named for what they are, and sound sessions left in peace?
mod setup_mistakes;

/// Does comparing two results say what changed, on the same dwells?
mod compare;

/// Does a CI job learn which limit is broken, by what, and in the form it reads?
mod check;

/// Is what the documentation lists what the program knows?
mod docs;

/// Does the plan propose dwells that, recorded, settle what the recording at hand leaves open?
mod plan;

/// Does the live page's server outlive clients that say nothing, too much, or leave?
mod live_server;

/// Does what befalls one recording of a campaign cost that recording alone?
mod campaign_faults;

/// Does the report open offline in a real browser, show what the summary says, and refit live?
mod report_page;

/// Do wheel, completions, man pages, the example for CI do what they say, and is nothing in it that may not be?
mod packaging;

/// Do set-points computed through the calibrated model bring the rig to where it is sent?
mod compensation;

/// Does a calibrated model give the same digits in a C program, in Python and on the command line?
mod kinematics;

/// Do public parsers read what is written for robots, planners and simulators as the arm that was calibrated?
mod written_formats;

/// Is a recording that is there twice, in whatever encoding or in part, refused or counted once, and never another?
mod counted_once;

/// What is a calibrated model worth on recordings it never saw?
mod verify;

/// Do the points that a laser tracker exported calibrate the arm whose joints were recorded, dwell by dwell?
mod tracker_points;

/// Does what one session taught help in another, effect by effect?
mod transfer;

/// Does the calibration table do without a camera?
mod camera_free;

/// Does an archive survive kills, does sharing it out change a byte, and are changes over months seen?
mod batch;

/// Are results of many days pooled into what one fit of all their recordings gives, and strangers refused by name?
mod pool;

/// Do two arms with joined tips calibrate each other from one recording, and is what they cannot know told?
mod two_arms;

/// Is an arm calibrated by what it is measured against: points, distances, heights, without a camera?
mod measures;

/// What do verify, compensate and pool say of two arms with joined tips?
mod joined_tips;

/// Are the two arms of one torso one robot, and is its waist told only where something sees the hands?
mod humanoid;

/// Are several markers a pose one pose, and one that came loose found as that?
mod several_markers;

/// Does a recording in a bucket give what it gives on disk, for a fraction of its bytes?
#[cfg(feature = "s3")]
mod object_storage;

/// Does a thin recording hold the wanted channels untouched, and give the same numbers?
mod extract;
