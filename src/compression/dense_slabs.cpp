#include "dense_slabs.h"

#include <array>
#include <sstream>
#include <stdexcept>

namespace ttsdf {

WeightedSlabSource denseSlabs(const DenseTensor& tensor, const std::vector<float>& weights,
                              const TensorTrain& train, const char* caller) {
  if ((tensor.dims() != train.dims()).any() || weights.size() != tensor.size()) {
    std::ostringstream text;
    text << caller << ": got a tensor of " << tensor.dims().transpose() << " with " << weights.size()
         << " weights and a train of " << train.dims().transpose() << ", wanted equal shapes";
    throw std::invalid_argument(text.str());
  }
  using Eigen::Index;
  const Index nx = tensor.dims()[0], ny = tensor.dims()[1];
  const std::array<Index, 3> of_axis = {{1, nx, nx * ny}};
  std::array<Index, 3> stride{};
  for (std::size_t mode = 0; mode < 3; ++mode)
    stride[mode] = of_axis[static_cast<std::size_t>(train.axes()[mode])];
  return [&tensor, &weights, stride](int j, int begin, Eigen::Ref<Eigen::MatrixXf> values,
                                     Eigen::Ref<Eigen::MatrixXf> slab_weights) {
    using Strides = Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>;
    using Strided = Eigen::Map<const Eigen::MatrixXf, 0, Strides>;
    const Index offset = j * stride[1] + begin * stride[2];
    const Strides strides(stride[2], stride[0]);
    values = Strided(tensor.data() + offset, values.rows(), values.cols(), strides);
    slab_weights = Strided(weights.data() + offset, values.rows(), values.cols(), strides);
  };
}

}  // namespace ttsdf
