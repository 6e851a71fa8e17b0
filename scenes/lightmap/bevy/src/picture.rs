//! A picture of the scene without a window, in linear values: PFM.

use crate::Maps;
use bevy::app::ScheduleRunnerPlugin;
use bevy::asset::LoadState;
use bevy::camera::RenderTarget;
use bevy::prelude::*;
use bevy::render::RenderPlugin;
use bevy::render::render_resource::TextureFormat;
use bevy::render::view::Hdr;
use bevy::render::view::screenshot::{Screenshot, ScreenshotCaptured};
use bevy::window::ExitCondition;
use bevy::winit::WinitPlugin;
use std::path::PathBuf;
use std::time::Duration;

/// Width and height of the picture in pixels.
const SIZE: u32 = 300;

/// Frames after the maps are loaded, until they are on the graphics processor.
const FRAMES: u32 = 8;

/// The file of the picture, the image that the camera renders to, and frames since the maps are loaded.
#[derive(Resource)]
struct Picture {
    file: PathBuf,
    image: Handle<Image>,
    frames: u32,
}

pub fn add_plugins(app: &mut App, file: PathBuf) {
    let window = WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    let render = RenderPlugin { synchronous_pipeline_compilation: true, ..default() };
    app.add_plugins(DefaultPlugins.set(window).set(render).disable::<WinitPlugin>())
        .add_plugins(ScheduleRunnerPlugin::run_loop(Duration::from_millis(10)));
    let target = Image::new_target_texture(SIZE, SIZE, TextureFormat::Rgba16Float, None);
    let image = app.world_mut().resource_mut::<Assets<Image>>().add(target);
    app.insert_resource(Picture { file, image, frames: 0 })
        .add_systems(PostStartup, aim)
        .add_systems(Update, take);
}

/// Lets the camera render to the image.
fn aim(mut commands: Commands, picture: Res<Picture>, camera: Single<Entity, With<Camera3d>>) {
    commands.entity(*camera).insert((Hdr, RenderTarget::from(picture.image.clone())));
}

/// Takes the picture and ends the program.
fn take(mut commands: Commands, mut picture: ResMut<Picture>, assets: Res<AssetServer>, maps: Res<Maps>) {
    for map in &maps.0 {
        if let LoadState::Failed(error) = assets.load_state(map) {
            panic!("{error}");
        }
    }
    if maps.0.iter().all(|map| assets.is_loaded_with_dependencies(map)) {
        picture.frames += 1;
    }
    if picture.frames != FRAMES {
        return;
    }
    let file = picture.file.clone();
    commands.spawn(Screenshot::image(picture.image.clone())).observe(
        move |captured: On<ScreenshotCaptured>, mut exit: MessageWriter<AppExit>| {
            let written = std::fs::write(&file, pfm(&captured.image));
            exit.write(match written {
                Ok(()) => AppExit::Success,
                Err(error) => {
                    eprintln!("{}: {error}", file.display());
                    AppExit::error()
                }
            });
        },
    );
}

/// Rows from the bottom, as PFM has them.
fn pfm(image: &Image) -> Vec<u8> {
    let [width, height] = [image.width(), image.height()];
    let mut bytes = format!("PF\n{width} {height}\n-1.0\n").into_bytes();
    for (y, x) in (0..height).rev().flat_map(|y| (0..width).map(move |x| (y, x))) {
        let color = image.get_color_at(x, y).expect("a picture of half floats").to_linear();
        bytes.extend([color.red, color.green, color.blue].into_iter().flat_map(f32::to_le_bytes));
    }
    bytes
}
