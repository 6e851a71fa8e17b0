//! Shards on schedulers that exist: a Slurm of this machine alone, Open Job Description, and the schema of
//! Kubernetes. Their merged pictures have the bytes of one run.

use crate::command::{command, exists, output, run};
use crate::{Failure, Outcome, Project};
use core::time::Duration;
use std::fs;
use std::path::PathBuf;
use std::process::{Child, Stdio};
use std::thread::sleep;

/// Samples of the pictures, and of the one that is requeued: its shards last for several checkpoints.
const SAMPLES: [u32; 2] = [16, 512];

/// Tries, a tenth of a second apart, after which a scheduler never answers.
const TRIES: u32 = 3000;

/// Renders under each scheduler.
pub(crate) fn check(project: &Project) -> Outcome {
    for (program, package) in [("munged", "munge"), ("sinfo", "slurm-wlm"), ("python3", "python3-venv")] {
        if !exists(program) {
            return Err(Failure::Missing(format!("no {program}: apt-get install {package}")));
        }
    }
    let build = "cargo build --profile quick --quiet --locked --workspace --bin halflight";
    run(&mut command(&project.root, build))?;
    let folder = std::env::temp_dir().join(format!("halflight-cluster-{}", std::process::id()));
    fs::create_dir_all(&folder).map_err(|error| failed(format!("{}: {error}", folder.display())))?;
    let cluster = Cluster {
        manifests: project.root.join("docs/cluster"),
        program: std::env::current_exe().unwrap_or_default().with_file_name("halflight"),
        folder,
    };
    let cornell = project.root.join("scenes/cornell/cornell.obj");
    let scene = format!(
        "[[mesh]]\nfile = {:?}\n\n[render]\nsize = [64, 48]\nmethod = \"path\"\n",
        cornell.display().to_string()
    );
    cluster.write("scene.toml", &scene)?;
    let wholes = SAMPLES.map(|samples| cluster.whole(samples));
    let [whole, long] = wholes;
    let (whole, long) = (whole?, long?);

    let slurm = Slurm::start(&cluster)?;
    let [_, merge] = slurm.submit(SAMPLES[0])?;
    slurm.wait(&merge)?;
    cluster.compare("slurm-16.pfm", &whole)?;
    let [array, merge] = slurm.submit(SAMPLES[1])?;
    let part = slurm.requeue(&array)?;
    slurm.wait(&merge)?;
    if !slurm.job(&part)?.contains("Restarts=1") {
        return Err(failed(format!("{part} was not requeued: {}", slurm.job(&part)?)));
    }
    cluster.compare("slurm-512.pfm", &long)?;
    drop(slurm);

    let venv = project.root.join("target/cluster");
    run(command(&cluster.folder, "python3 -m venv").arg(&venv))?;
    let tool = |name: &str| venv.join("bin").join(name).display().to_string();
    let packages = "install --quiet --disable-pip-version-check openjd-cli kubernetes-validate";
    run(&mut command(&cluster.folder, &format!("{} {packages}", tool("pip"))))?;
    let mut openjd = command(&cluster.folder, &format!("{} run", tool("openjd")));
    openjd.arg(cluster.manifests.join("openjd.yaml"));
    let values = "Scene=scene.toml Samples=16 Films=openjd Output=openjd.pfm";
    openjd.args(["--step", "Merge", "--run-dependencies"]);
    openjd.args(values.split(' ').flat_map(|value| ["-p", value]));
    run(openjd.arg("-p").arg(format!("Program={}", cluster.program.display())))?;
    cluster.compare("openjd.pfm", &whole)?;
    let mut schema = command(&cluster.manifests, &format!("{} --strict", tool("kubernetes-validate")));
    run(schema.arg("kubernetes.yaml"))?;
    let _ = fs::remove_dir_all(&cluster.folder);
    Ok("Slurm, a requeued part, Open Job Description: bits of one run; manifest of Kubernetes".to_owned())
}

fn failed(text: String) -> Failure {
    Failure::Failed(text)
}

/// Files of the check.
struct Cluster {
    manifests: PathBuf,
    program: PathBuf,
    folder: PathBuf,
}

impl Cluster {
    fn write(&self, name: &str, text: &str) -> Result<(), Failure> {
        fs::write(self.folder.join(name), text).map_err(|error| failed(format!("{name}: {error}")))
    }

    /// Bytes of the picture of one run. The format has no metadata.
    fn whole(&self, samples: u32) -> Result<Vec<u8>, Failure> {
        let program = self.program.display();
        let line = format!("{program} render scene.toml -q --spp {samples} -o whole.pfm");
        run(&mut command(&self.folder, &line))?;
        fs::read(self.folder.join("whole.pfm")).map_err(|error| failed(error.to_string()))
    }

    fn compare(&self, name: &str, whole: &[u8]) -> Result<(), Failure> {
        match fs::read(self.folder.join(name)) {
            Ok(merged) if merged == whole => Ok(()),
            Ok(_) => Err(failed(format!("{name} differs from one run"))),
            Err(error) => Err(failed(format!("{name}: {error}"))),
        }
    }
}

/// A Slurm of this machine, of one node. It ends with this value.
struct Slurm<'c> {
    cluster: &'c Cluster,
    daemons: Vec<Child>,
}

impl<'c> Slurm<'c> {
    fn start(cluster: &'c Cluster) -> Result<Self, Failure> {
        let folder = &cluster.folder;
        let place = folder.display();
        let user = output(&mut command(folder, "id -un"))?;
        let host = output(&mut command(folder, "hostname -s"))?;
        let processors = output(&mut command(folder, "nproc"))?;
        for name in ["state", "spool"] {
            fs::create_dir_all(folder.join(name)).map_err(|error| failed(error.to_string()))?;
        }
        run(&mut command(folder, &format!("/usr/sbin/mungekey --create --keyfile={place}/key")))?;
        let settings = format!(
            "ClusterName=check
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort=46817
SlurmdPort=46818
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket={place}/munge.socket,cred_expire=3
SlurmUser={user}
SlurmdUser={user}
StateSaveLocation={place}/state
SlurmdSpoolDir={place}/spool
SlurmctldPidFile={place}/slurmctld.pid
SlurmdPidFile={place}/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
MailProg=/bin/true
SchedulerType=sched/builtin
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
NodeName={host} NodeAddr=127.0.0.1 CPUs={processors}
PartitionName=all Nodes=ALL Default=YES
"
        );
        cluster.write("slurm.conf", &settings)?;
        let mut slurm = Self { cluster, daemons: Vec::new() };
        slurm.daemon(&format!(
            "/usr/sbin/munged --foreground --force --socket={place}/munge.socket --key-file={place}/key \
             --log-file={place}/munged.log --pid-file={place}/munged.pid --seed-file={place}/seed"
        ))?;
        until("munged", || Ok(folder.join("munge.socket").exists().then_some(())))?;
        slurm.daemon("/usr/sbin/slurmctld -D")?;
        until("slurmctld", || Ok(slurm.client("sinfo -h").is_ok().then_some(())))?;
        slurm.daemon("/usr/sbin/slurmd -D")?;
        until("slurmd", || Ok(slurm.client("sinfo -h -o %T")?.contains("idle").then_some(())))?;
        Ok(slurm)
    }

    fn daemon(&mut self, line: &str) -> Result<(), Failure> {
        let mut daemon = command(&self.cluster.folder, line);
        daemon.env("SLURM_CONF", self.cluster.folder.join("slurm.conf"));
        daemon.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
        self.daemons.push(daemon.spawn().map_err(|error| Failure::Missing(format!("{line}: {error}")))?);
        Ok(())
    }

    /// Answer of a command of Slurm.
    fn client(&self, line: &str) -> Outcome {
        let mut request = command(&self.cluster.folder, line);
        output(request.env("SLURM_CONF", self.cluster.folder.join("slurm.conf")))
    }

    /// Numbers of an array of four and of the job that merges it.
    fn submit(&self, samples: u32) -> Result<[String; 2], Failure> {
        let Cluster { manifests, program, folder } = self.cluster;
        let line = format!("bash {}/slurm.sh 4 --checkpoint-every 1s", manifests.display());
        let mut script = command(folder, &line);
        script.env("SLURM_CONF", folder.join("slurm.conf")).env("HALFLIGHT", program);
        script.env("SCENE", "scene.toml").env("SPP", samples.to_string());
        script.env("FILMS", format!("films-{samples}")).env("OUTPUT", format!("slurm-{samples}.pfm"));
        let numbers = output(&mut script)?;
        let mut numbers = numbers.lines().map(str::to_owned);
        match (numbers.next(), numbers.next()) {
            (Some(array), Some(merge)) => Ok([array, merge]),
            _ => Err(failed("slurm.sh prints no numbers of its jobs".to_owned())),
        }
    }

    fn job(&self, number: &str) -> Outcome {
        self.client(&format!("scontrol show job {number}"))
    }

    /// Requeues a running part that has a film, and returns its number.
    fn requeue(&self, array: &str) -> Outcome {
        let part = until("a part with a film", || {
            let running = self.client("squeue -h -t R -o %F_%K")?;
            let has_film = |part: &&str| {
                let index = part.strip_prefix(&format!("{array}_"));
                index.is_some_and(|index| {
                    self.cluster.folder.join(format!("films-{}/{index}.film", SAMPLES[1])).exists()
                })
            };
            Ok(running.lines().find(has_film).map(str::to_owned))
        })?;
        self.client(&format!("scontrol requeue {part}"))?;
        Ok(part)
    }

    /// Waits for the end of a job.
    fn wait(&self, number: &str) -> Result<(), Failure> {
        until(&format!("job {number}"), || {
            let job = self.job(number)?;
            match job.contains("JobState=COMPLETED") {
                true => Ok(Some(())),
                false if ["PENDING", "RUNNING", "COMPLETING"].iter().any(|state| job.contains(state)) => {
                    Ok(None)
                }
                false => Err(failed(job)),
            }
        })
    }
}

impl Drop for Slurm<'_> {
    fn drop(&mut self) {
        for name in ["halflight", "halflight-merge"] {
            let _ = self.client(&format!("scancel --name={name}"));
        }
        for daemon in self.daemons.iter_mut().rev() {
            let _ = daemon.kill();
            let _ = daemon.wait();
        }
    }
}

/// The value that `ready` has at last.
fn until<T>(name: &str, mut ready: impl FnMut() -> Result<Option<T>, Failure>) -> Result<T, Failure> {
    for _ in 0..TRIES {
        if let Some(value) = ready()? {
            return Ok(value);
        }
        sleep(Duration::from_millis(100));
    }
    Err(failed(format!("{name} does not come")))
}
