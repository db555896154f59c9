!! Inputs for the tests of studies.
module study_samples
   use razy_core_error, only: error_t
   use razy_core_text, only: string_t
   use razy_input_input, only: input_t
   use razy_scenes_case, only: read_study
   implicit none(type, external)
   private

   public :: bumper, input_of, two_masses

   character(*), parameter :: nl = new_line("a")

   !> A block on a spring, shaken, that hits a bumper.
   character(*), parameter :: bumper = "&scene kind='lumped', title='Mass against a stop' /"//nl// &
                              "&mass name='block', value=2.0 /"//nl// &
                              "&spring between='block','frame', stiffness=2.0e4, damping=8.0 /"//nl// &
                           "&stop name='bumper', between='block','frame', clearance=1.0e-3, stiffness=1.0e6, damping=50.0 /"//nl// &
                              "&load on='block', amplitude=30.0, frequency=14.0 /"//nl// &
                              "&motion t_end=0.5, start='zero' /"//nl// &
                              "&record observable='displacement', what='extrema', from=0.2 /"//nl// &
                              "&record observable='contact_force', what='statistics', from=0.2 /"//nl

   !> Two masses of 2 kg and 1 kg, one behind the other.
   character(*), parameter :: two_masses = "&scene kind='lumped', title='Two masses' /"//nl// &
                              "&mass name='a', value=2.0 /"//nl//"&mass name='b', value=1.0 /"//nl// &
                             "&spring between='a','frame', stiffness=2000.0 /"//nl//"&spring between='a','b', stiffness=500.0 /"//nl

contains

   !> The input of a text.
   function input_of(text) result(input)
      character(*), intent(in) :: text
      type(input_t) :: input

      type(error_t), allocatable :: error
      type(string_t) :: none(0)

      call read_study(input, text, "sample.nml", none, error)
      if (allocated(error)) error stop error%message
   end function input_of

end module study_samples
