//! Server of pages for tests in a browser, and packages that npm fetches for them.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, Sender, channel};

/// The version of three.js whose layouts the pages rely on.
pub(crate) const THREE: &str = "three@0.187.0";

/// The folder of a package, as `name@version`, which npm fetches into the folder of builds once; without npm
/// a message that the test is skipped.
pub(crate) fn package(name: &str) -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target").join(name);
    let package = folder.join("package");
    if package.is_dir() {
        return Some(package);
    }
    let npm = Command::new("npm").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    if !npm.is_ok_and(|status| status.success()) {
        println!("skipped: no npm on this machine to fetch {name}");
        return None;
    }
    std::fs::create_dir_all(&folder).unwrap();
    let run = |program: &str, arguments: &[&str]| {
        let output = Command::new(program).args(arguments).current_dir(&folder).output().unwrap();
        assert!(output.status.success(), "{program}: {}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    };
    let archive = run("npm", &["pack", name, "--silent"]);
    run("tar", &["xzf", archive.lines().last().unwrap()]);
    Some(package)
}

/// Serves the files of `folder`, and those of packages below their names, to browsers of this machine until
/// the program ends. Returns the port, and the bodies that pages post.
pub(crate) fn serve(folder: PathBuf, packages: &[(&'static str, PathBuf)]) -> (u16, Receiver<String>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    let (sender, receiver) = channel();
    let packages = packages.to_vec();
    std::thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let (folder, packages, sender) = (folder.clone(), packages.clone(), sender.clone());
            std::thread::spawn(move || answer(stream, &folder, &packages, &sender));
        }
    });
    (port, receiver)
}

fn answer(
    mut stream: TcpStream,
    folder: &Path,
    packages: &[(&str, PathBuf)],
    posted: &Sender<String>,
) -> std::io::Result<()> {
    let mut reader = BufReader::new(stream.try_clone()?);
    let mut request = String::new();
    reader.read_line(&mut request)?;
    let mut length = 0;
    loop {
        let mut line = String::new();
        reader.read_line(&mut line)?;
        match line.trim().split_once(": ") {
            Some((name, value)) if name.eq_ignore_ascii_case("content-length") => {
                length = value.parse().unwrap_or(0);
            }
            Some(_) => {}
            None => break,
        }
    }
    let name = request.split(['?', ' ']).nth(1).unwrap_or_default().trim_start_matches('/');
    if request.starts_with("POST") {
        let mut body = vec![0; length];
        reader.read_exact(&mut body)?;
        // The test may have ended.
        let _ = posted.send(String::from_utf8_lossy(&body).into_owned());
    }
    let of_package = packages.iter().find_map(|(package, folder)| {
        let (_, rest) = name.split_once(&format!("{package}/"))?;
        Some(folder.join(rest))
    });
    let path = of_package.unwrap_or_else(|| folder.join(name));
    let (status, bytes) = match std::fs::read(&path) {
        Ok(bytes) => ("200 OK", bytes),
        Err(_) if request.starts_with("POST") => ("200 OK", Vec::new()),
        Err(_) => ("404 Not Found", Vec::new()),
    };
    let kind = match path.extension().and_then(|extension| extension.to_str()) {
        Some("html") => "text/html",
        Some("css") => "text/css",
        Some("js") => "text/javascript",
        Some("json") => "application/json",
        Some("wasm") => "application/wasm",
        _ => "application/octet-stream",
    };
    let length = bytes.len();
    write!(stream, "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n")?;
    write!(stream, "Connection: close\r\n\r\n")?;
    stream.write_all(&bytes)
}
