//! Kinds of cameras in scene files, and their flags.

use crate::support::Folder;
use halflight::Renderer;
use halflight_core::scene::CameraKind;
use std::fs::write;

/// A folder whose `a.toml` has a camera with these keys.
fn folder(name: &str, keys: &str) -> Folder {
    let folder = Folder::new(name);
    let camera = format!("[camera]\neye = [0, 1, 3]\nlook_at = [0, 1, 0]\n{keys}");
    write(folder.path("a.toml"), format!("[[mesh]]\nfile = \"scene.obj\"\n{camera}")).unwrap();
    folder
}

#[test]
fn an_orthographic_camera_has_the_height_of_its_picture() {
    let folder = folder("camera-parallel", "kind = \"orthographic\"\nheight = 3\nlens_radius = 0.25\n");
    let renderer = Renderer::open(folder.path("a.toml")).unwrap();
    let (loaded, length) = (renderer.scene(), |x| renderer.scene().transform.length(x) as f32);
    let camera = loaded.camera.unwrap();
    assert_eq!(camera.kind, CameraKind::Orthographic { half_height: length(1.5) });
    assert_eq!([camera.lens_radius, camera.focus_distance], [0.25, 3.0].map(length));
    let camera = &folder.object("info a.toml --json")["camera"];
    assert_eq!((camera["kind"].as_str(), camera["height"].as_f64()), (Some("orthographic"), Some(3.0)));
    // Flags move it, and keep its kind.
    let moved = folder.object("info a.toml --eye 1,1,3 --look-at 1,1,0 --json")["camera"].clone();
    assert_eq!((moved["kind"].as_str(), moved["height"].as_f64()), (Some("orthographic"), Some(3.0)));
    assert!(folder.refused("info a.toml --fov 30").contains("--fov is of perspective cameras"));
}

#[test]
fn a_panorama_has_no_lens() {
    let folder = folder("camera-panorama", "kind = \"panorama\"\n");
    let renderer = Renderer::open(folder.path("a.toml")).unwrap();
    assert_eq!(renderer.scene().camera.unwrap().kind, CameraKind::Panorama);
    assert_eq!(folder.object("info a.toml --json")["camera"]["kind"], "panorama");
    assert!(folder.refused("info a.toml --lens 0.1").contains("a panorama has no lens"));
}

#[test]
fn keys_of_other_kinds_are_refused_at_the_camera() {
    for (keys, message) in [
        ("height = 2\n", "a perspective camera has no `height`"),
        ("kind = \"orthographic\"\n", "an orthographic camera needs `height`"),
        ("kind = \"orthographic\"\nheight = 2\nfov = 40\n", "an orthographic camera needs `height`"),
        ("kind = \"orthographic\"\nheight = 0\n", "a number above 0 is expected"),
        ("kind = \"panorama\"\nfov = 40\n", "a panorama has no `fov`"),
        ("kind = \"panorama\"\nlens_radius = 1\n", "a panorama has no `fov`"),
        ("kind = \"fisheye\"\n", "unknown variant `fisheye`"),
    ] {
        let said = folder("camera-refused", keys).refused("info a.toml");
        assert!(said.contains(message) && said.contains("a.toml:"), "{keys}: {said}");
    }
}
