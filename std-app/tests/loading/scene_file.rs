//! Errors of scene files.

use halflight::load::scene_file::parse;
use std::path::Path;

fn error(text: &str) -> String {
    parse(text, Path::new("a.toml")).unwrap_err().to_string()
}

#[test]
fn errors_have_line_and_column() {
    let check = |text: &str, line: u32, problem: &str| {
        let error = error(text);
        assert!(error.starts_with(&format!("a.toml:{line}:")) && error.contains(problem), "{error}");
    };
    check(
        "[camera]\neyes = [0, 0, 0]\n",
        2,
        "unknown field `eyes`\n  help: expected one of `eye`, `look_at`",
    );
    check("\n  [render\n", 2, "");
    check("[camera]\neye = [0, 0]\nlook_at = [0, 0, 1]", 2, "");
    check("[camera]\neye = [0, 0, nan]\nlook_at = [0, 0, 1]", 2, "must be finite");
    check("[camera]\neye = [0, 0, 0]\nlook_at = [0, 0, 1]\nfov = 180", 4, "between 0 and 180");
    check("[[mesh]]\nfile = \"a.obj\"\nscale = \"big\"", 3, "a number or three numbers");
    let light = "[[light]]\nkind = \"point\"\nposition = [0, 0, 0]\nintensity = ";
    check(&format!("{light}-9"), 4, "-9.0 is negative");
    check(&format!("{light}[1, 2, 1e38]"), 4, "1e38 is too large: light and colours are at most 1e15");
    check(&format!("{light}[1, 2]"), 4, "three numbers");
    check(&format!("{light}nan"), 4, "finite");
    check("[environment]\nradiance = 1e30", 2, "at most 1e15");
    check("[environment]\nradiance = [0, -1e-9, 0]", 2, "negative");
    check("[material.a]\nemission = inf", 2, "too large");
    check("[material.a]\ncolor = -0.5", 2, "negative");
    check("[[mesh]]\nfile = \"a.obj\"\nscale = 1e31", 3, "at most 1e30");
    check("[[mesh]]\nfile = \"a.obj\"\nscale = [1, 1, nan]", 3, "finite");
    check("[camera]\neye = [0, 0, 0]\nlook_at = [0, 0, 1]\nlens_radius = -1", 4, "negative");
    check("[render]\nspp = -1", 2, "");
    check("[[light]]\nkind = \"laser\"", 2, "`point`, `spot`");
    check("[[mesh]]\nfile = \"a.obj\"\nmatrix = [[1, 0, 0, 0]]", 3, "three or four rows");
}
