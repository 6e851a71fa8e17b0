//! Memory limits of the control groups of this process (cgroups(7), both versions): those of its own group
//! and of all ancestors, since the smallest of them ends the process.

use std::fs;
use std::path::{Component, Path, PathBuf};

/// Files with a limit in bytes, and `memory.stat` with that of groups outside a container.
const LIMITS: [(&str, &str); 4] = [
    ("memory.max", ""),
    // Above it the kernel slows the process down to a halt.
    ("memory.high", ""),
    ("memory.limit_in_bytes", ""),
    ("memory.stat", "hierarchical_memory_limit "),
];

/// The smallest memory limit in bytes; `None` without a limit.
pub(crate) fn memory_limit() -> Option<usize> {
    let read = |path: &Path| fs::read_to_string(path).unwrap_or_default();
    let folders = folders(&read("/proc/self/cgroup".as_ref()), &read("/proc/self/mountinfo".as_ref()));
    let limits = folders.iter().flat_map(|folder| {
        LIMITS.map(|(file, name)| {
            let text = read(&folder.join(file));
            text.lines().find_map(|line| line.strip_prefix(name)?.trim().parse().ok())
        })
    });
    limits.flatten().min()
}

/// Folders of the groups of a process and of their ancestors, by its `/proc/PID/cgroup` and
/// `/proc/PID/mountinfo`.
fn folders(groups: &str, mounts: &str) -> Vec<PathBuf> {
    let folders = |line: &str| {
        let (mount, filesystem) = line.split_once(" - ")?;
        let (kind, options) = filesystem.split_once(' ')?;
        let is_ours = kind == "cgroup2" || kind == "cgroup" && controls_memory(options.rsplit(' ').next()?);
        let mut paths = mount.split(' ').skip(3).map(unescaped);
        let (root, point) = (paths.next().filter(|_| is_ours)?, paths.next()?);
        let group = groups.lines().find_map(|line| group(line, kind == "cgroup2"))?;
        // The mount may show a part of the tree that excludes the group.
        let below = Path::new(group).strip_prefix(&root).unwrap_or(Path::new(""));
        let below: PathBuf = below.components().filter(|part| matches!(part, Component::Normal(_))).collect();
        let own = point.join(below);
        Some(own.ancestors().take_while(|folder| folder.starts_with(&point)).map(Path::to_owned).collect())
    };
    mounts.lines().filter_map(folders).flat_map(|folders: Vec<PathBuf>| folders).collect()
}

/// The group in a line `NUMBER:CONTROLLERS:GROUP`, if it is of version 2 or, otherwise, limits memory.
fn group(line: &str, is_unified: bool) -> Option<&str> {
    let (number, rest) = line.split_once(':')?;
    let (controllers, group) = rest.split_once(':')?;
    (if is_unified { number == "0" } else { controls_memory(controllers) }).then_some(group)
}

fn controls_memory(controllers: &str) -> bool {
    controllers.split(',').any(|controller| controller == "memory")
}

/// A path of `mountinfo`, whose blanks and backslashes are octal numbers.
fn unescaped(text: &str) -> PathBuf {
    let (mut path, mut rest) = (String::new(), text);
    while let Some((before, code)) = rest.split_once('\\') {
        path += before;
        let byte = code.get(..3).and_then(|code| u8::from_str_radix(code, 8).ok());
        path.push(byte.map_or('\\', char::from));
        rest = byte.and_then(|_| code.get(3..)).unwrap_or(code);
    }
    (path + rest).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(groups: &str, mounts: &str, expected: &[&str]) {
        assert_eq!(folders(groups, mounts), expected.iter().map(PathBuf::from).collect::<Vec<_>>());
    }

    #[test]
    fn a_group_counts_with_all_ancestors() {
        let mount = "35 24 0:30 / /sys/fs/cgroup rw,nosuid - cgroup2 cgroup2 rw,nsdelegate\n";
        check(
            "0::/system.slice/slurmstepd.scope/job_1/step_0\n",
            mount,
            &[
                "/sys/fs/cgroup/system.slice/slurmstepd.scope/job_1/step_0",
                "/sys/fs/cgroup/system.slice/slurmstepd.scope/job_1",
                "/sys/fs/cgroup/system.slice/slurmstepd.scope",
                "/sys/fs/cgroup/system.slice",
                "/sys/fs/cgroup",
            ],
        );
        check("0::/\n", mount, &["/sys/fs/cgroup"]);
        check("0::/../../elsewhere\n", mount, &["/sys/fs/cgroup/elsewhere", "/sys/fs/cgroup"]);
    }

    #[test]
    fn version_1_has_a_tree_for_memory() {
        let mounts = "30 25 0:26 / /sys/fs/cgroup ro - tmpfs tmpfs ro,mode=755\n\
            31 30 0:27 / /sys/fs/cgroup/pids rw shared:9 - cgroup cgroup rw,pids\n\
            32 30 0:28 / /sys/fs/cgroup/memory rw shared:9 - cgroup cgroup rw,memory\n\
            33 30 0:29 / /sys/fs/cgroup/unified rw - cgroup2 cgroup2 rw\n";
        check(
            "5:pids:/other\n4:memory:/a/b\n0::/c\n",
            mounts,
            &[
                "/sys/fs/cgroup/memory/a/b",
                "/sys/fs/cgroup/memory/a",
                "/sys/fs/cgroup/memory",
                "/sys/fs/cgroup/unified/c",
                "/sys/fs/cgroup/unified",
            ],
        );
    }

    #[test]
    fn a_container_sees_its_group_as_the_root_of_the_mount() {
        let mounts = "9 8 0:7 /docker/af01 /sys/fs/cgroup/memory ro - cgroup cgroup rw,memory,hugetlb\n";
        check("4:hugetlb,memory:/docker/af01\n", mounts, &["/sys/fs/cgroup/memory"]);
        check("4:memory:/docker/af01/sub\n", mounts, &["/sys/fs/cgroup/memory/sub", "/sys/fs/cgroup/memory"]);
        check("4:memory:/elsewhere\n", mounts, &["/sys/fs/cgroup/memory"]);
    }

    #[test]
    fn names_may_have_blanks_and_backslashes() {
        let mounts = "9 8 0:7 /my\\040job\\134x2d1 /sys/fs/c\\040g rw - cgroup2 none rw\n";
        check("0::/my job\\x2d1/a b\n", mounts, &["/sys/fs/c g/a b", "/sys/fs/c g"]);
        check("", mounts, &[]);
        check("0::/", "nothing to see here\n", &[]);
    }
}
