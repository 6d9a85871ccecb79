#include "ttsdf_localization/tensor/dense_tensor.h"

#include <sstream>
#include <stdexcept>

namespace ttsdf {

DenseTensor::DenseTensor(const Dims& dims, float value) : dims_(dims) {
  if ((dims < 1).any()) {
    std::ostringstream text;
    text << "tensor: got extents " << dims.transpose() << ", wanted all >= 1";
    throw std::invalid_argument(text.str());
  }
  data_.assign(static_cast<std::size_t>(dims[0]) * static_cast<std::size_t>(dims[1]) *
                   static_cast<std::size_t>(dims[2]),
               value);
}

}  // namespace ttsdf
