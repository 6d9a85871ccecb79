#pragma once
// Flags that say what a map is made of: the same for all programs that make some.

#include "ttsdf_localization/frames/frame_folder.h"
#include "ttsdf_localization/tools/build_sources.h"
#include "ttsdf_localization/tools/command_line.h"

namespace ttsdf {

void declareFrames(CommandLine& line, BuildArguments& a);
/// Those, and every other source.
void declareSources(CommandLine& line, BuildArguments& a);

/// Throws UsageError, as checkSources.
void checkFrameFlags(const BuildArguments& a);
/// One source, with flags that fit it and options that hold.
void checkSources(const BuildArguments& a);

FrameFolderOptions frameFolderOptions(const BuildArguments& a);

}  // namespace ttsdf
