#pragma once
// The formats behind readCloudFile.

#include "ttsdf_localization/readers/cloud_file.h"
#include "ttsdf_localization/readers/file_bytes.h"

namespace ttsdf {

CloudFile readPcd(const FileBytes& file);
CloudFile readPlyCloud(const FileBytes& file);
CloudFile readTextCloud(const FileBytes& file);
CloudFile readRawCloud(const FileBytes& file);

/// LZF, the compression of PCD files. False if the bytes do not expand to exactly `size`.
bool expandLzf(const unsigned char* in, std::size_t in_size, unsigned char* out, std::size_t size);

}  // namespace ttsdf
