//! Slurm on this machine alone, without systemd: munged, slurmctld and slurmd in a folder of their own.

use super::skip;
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// A running Slurm; stopped when dropped.
pub struct Slurm {
    folder: tempfile::TempDir,
}

/// Starts it, if Debian's `slurm-wlm` and `munge` are here and this is root; otherwise the test is skipped.
#[track_caller]
pub fn slurm() -> Option<Slurm> {
    let missing = ["munged", "slurmctld", "slurmd", "sbatch"].into_iter().find(|name| which(name).is_none());
    // The daemons change to their users, which only root may.
    let root = Command::new("id").arg("-u").output().is_ok_and(|o| o.stdout == b"0\n");
    if missing.is_some() || !root {
        let why = missing.map_or("not root".to_owned(), |name| format!("no {name}"));
        skip(&format!("no Slurm on this machine ({why}); as root, apt-get install slurm-wlm munge"));
        return None;
    }
    let slurm = Slurm { folder: tempfile::tempdir().expect("temporary folder") };
    slurm.configure();
    for [daemon, arguments @ ..] in slurm.daemons() {
        let output = slurm.command(&daemon).args(arguments).output().expect("starting a daemon");
        assert!(output.status.success(), "{daemon}: {}", String::from_utf8_lossy(&output.stderr));
    }
    slurm.wait("an idle node", Duration::from_secs(60), |s| {
        let states = s.command("sinfo").args(["--noheader", "--format=%T"]).output().expect("sinfo");
        String::from_utf8_lossy(&states.stdout).trim() == "idle"
    });
    Some(slurm)
}

impl Slurm {
    /// A command that talks to this Slurm.
    pub fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.env("SLURM_CONF", self.path("slurm.conf"));
        command
    }

    /// Waits until nothing is queued or running.
    pub fn wait_for_jobs(&self) {
        self.wait("the end of all jobs", Duration::from_secs(600), |s| {
            s.queue().stdout.trim_ascii().is_empty()
        });
    }

    fn queue(&self) -> Output {
        self.command("squeue").args(["--noheader", "--format=%i %T %r"]).output().expect("squeue")
    }

    fn wait(&self, what: &str, most: Duration, done: impl Fn(&Slurm) -> bool) {
        let start = Instant::now();
        while !done(self) {
            let queue = String::from_utf8_lossy(&self.queue().stdout).into_owned();
            assert!(start.elapsed() < most, "waited {most:?} for {what}\n{queue}{}", self.logs());
            std::thread::sleep(Duration::from_millis(200));
        }
    }

    fn logs(&self) -> String {
        let read = |name: &str| std::fs::read_to_string(self.path(name)).unwrap_or_default();
        read("slurmctld.log") + &read("slurmd.log")
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn daemons(&self) -> [[String; 7]; 3] {
        let at = |option: &str, name: &str| format!("{option}={}", self.path(name).display());
        let munged = [
            "munged".into(),
            "--force".into(),
            at("--key-file", "munge.key"),
            at("--socket", "munge.sock"),
            at("--pid-file", "munged.pid"),
            at("--log-file", "munged.log"),
            at("--seed-file", "munge.seed"),
        ];
        // Repeating an option is harmless; the arrays are of one length.
        let of = |daemon: &str, option: &str| {
            let mut all: [String; 7] = std::array::from_fn(|_| option.to_owned());
            all[0] = daemon.to_owned();
            all
        };
        [munged, of("slurmctld", "-c"), of("slurmd", "-c")]
    }

    fn configure(&self) {
        let (folder, host) = (self.folder.path().display(), short_hostname());
        // Tasks of two processors run two at a time, as on a cluster: the scheduler starts jobs once a second.
        let cpus = std::thread::available_parallelism().map_or(1, usize::from).max(4);
        let [controller, node] = free_ports();
        for name in ["state", "spool"] {
            std::fs::create_dir(self.path(name)).expect("a folder");
        }
        let conf = format!(
            "ClusterName=armcal\nSlurmctldHost={host}(127.0.0.1)\nSlurmctldPort={controller}\nSlurmdPort={node}\n\
             SlurmUser=root\nAuthType=auth/munge\nAuthInfo=socket={folder}/munge.sock\n\
             StateSaveLocation={folder}/state\nSlurmdSpoolDir={folder}/spool\n\
             SlurmctldPidFile={folder}/slurmctld.pid\nSlurmdPidFile={folder}/slurmd.pid\n\
             SlurmctldLogFile={folder}/slurmctld.log\nSlurmdLogFile={folder}/slurmd.log\n\
             ProctrackType=proctrack/pgid\nTaskPlugin=task/none\nSelectType=select/cons_tres\n\
             SelectTypeParameters=CR_CPU\nJobAcctGatherType=jobacct_gather/none\n\
             AccountingStorageType=accounting_storage/none\nMailProg=/bin/true\n\
             SchedulerParameters=sched_interval=1,batch_sched_delay=0\nSlurmdParameters=config_overrides\n\
             NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} State=UNKNOWN\n\
             PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP\n"
        );
        std::fs::write(self.path("slurm.conf"), conf).expect("slurm.conf");
        let key: Vec<u8> = (0..1024u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
        std::fs::write(self.path("munge.key"), key).expect("a key");
        let mode = |name: &str, mode: u32| {
            let mode = std::os::unix::fs::PermissionsExt::from_mode(mode);
            std::fs::set_permissions(self.path(name), mode).expect("permissions");
        };
        mode("munge.key", 0o400);
        // munged refuses a socket in a folder that only its owner may enter.
        mode("", 0o755);
    }
}

impl Drop for Slurm {
    fn drop(&mut self) {
        for name in ["slurmd.pid", "slurmctld.pid", "munged.pid"] {
            if let Ok(pid) = std::fs::read_to_string(self.path(name)) {
                let _ = Command::new("kill").args(["-9", pid.trim()]).status();
            }
        }
    }
}

fn which(program: &str) -> Option<PathBuf> {
    let path = std::env::var_os("PATH")?;
    std::env::split_paths(&path)
        .chain([Path::new("/usr/sbin").into()])
        .map(|f| f.join(program))
        .find(|p| p.is_file())
}

fn short_hostname() -> String {
    let name = Command::new("hostname").arg("-s").output().expect("hostname").stdout;
    String::from_utf8_lossy(&name).trim().to_owned()
}

/// Two ports that were free a moment ago.
fn free_ports() -> [u16; 2] {
    let bound = [(); 2].map(|()| TcpListener::bind("127.0.0.1:0").expect("a port"));
    bound.map(|listener| listener.local_addr().expect("an address").port())
}
