// SPDX-License-Identifier: Apache-2.0
//
// itk_resample IMAGE TRANSFORM.h5 LIKE OUT linear|nearest
// The image through the transform on the grid of another one, with nothing but ITK.
#include <itkImage.h>
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>
#include <itkLinearInterpolateImageFunction.h>
#include <itkNearestNeighborInterpolateImageFunction.h>
#include <itkResampleImageFilter.h>
#include <itkTransformFileReader.h>

#include <iostream>
#include <string>

int main(int argc, char** argv) {
  if (argc != 6) return 2;
  using Image = itk::Image<float, 3>;
  try {
    auto transforms = itk::TransformFileReader::New();
    transforms->SetFileName(argv[2]);
    transforms->Update();
    auto* transform = dynamic_cast<itk::Transform<double, 3, 3>*>(transforms->GetTransformList()->front().GetPointer());
    if (!transform) return 3;
    const auto image = itk::ReadImage<Image>(argv[1]);
    const auto like = itk::ReadImage<Image>(argv[3]);
    auto resample = itk::ResampleImageFilter<Image, Image>::New();
    if (std::string(argv[5]) == "nearest")
      resample->SetInterpolator(itk::NearestNeighborInterpolateImageFunction<Image>::New());
    resample->SetInput(image);
    resample->SetTransform(transform);
    resample->SetReferenceImage(like);
    resample->UseReferenceImageOn();
    itk::WriteImage(resample->GetOutput(), argv[4]);
  } catch (const itk::ExceptionObject& e) {
    std::cerr << e << '\n';
    return 1;
  }
}
