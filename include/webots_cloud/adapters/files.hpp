// Files and folders of this computer.
#pragma once

#include <webots_cloud/error.hpp>
#include <webots_cloud/export.hpp>
#include <webots_cloud/own_files.hpp>
#include <webots_cloud/transport/folder_meter.hpp>
#include <webots_cloud/transport/text_files.hpp>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

namespace WEBOTS_CLOUD_API webots_cloud {

/// All bytes of a regular file. Never waits for anybody, whatever stands there.
///
/// Errors: `unavailable`, its detail the reason alone, as "it is larger than <limit> bytes".
result<std::string> read_regular_file(std::filesystem::path const& path, std::size_t limit);

/// Folders of this computer, measured on a thread of its own.
std::unique_ptr<FolderMeter> make_folder_meter();

/// Files of this computer, on a thread of its own.
std::unique_ptr<TextFiles> make_text_files();

/// From now on the calling thread, and every thread and program that it starts, can open no other files than
/// these (Landlock), executes no programs, mounts nothing, gains no privileges, signals nobody outside unless
/// that is asked for, and can't look into processes outside. What is open already stays usable. Files that do
/// not exist yet can't be among them; those in a folder may come later. Other threads stay as they are.
///
/// Errors: `unavailable`: the kernel can't do that, and nothing has changed.
result<> confine_to_files(OwnFiles const& files);

/// A thread that mounts and unmounts for all others while it exists, for which it has to be made before they
/// are confined to files.
class MountThread;
std::shared_ptr<MountThread> make_mount_thread();

} // namespace webots_cloud
