!! Inputs for the tests of studies.
module study_samples
   use razy_core_error, only: error_t
   use razy_core_text, only: string_t
   use razy_input_input, only: input_t
   use razy_scenes_case, only: read_study
   use razy_study_follow_follow, only: follow_t
   use razy_study_follow_request, only: new_request
   implicit none(type, external)
   private

   public :: bumper, compute, dead_zone, input_of, two_masses, wall

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

   !> x'' + 0.2 x' + x = cos ωt before a rigid wall at 0 that gives back all of the speed.
   character(*), parameter :: wall = "&scene kind='lumped' /"//nl//"&mass name='body', value=1.0 /"//nl// &
                              "&spring between='body','frame', stiffness=1.0, damping=0.2 /"//nl// &
                              "&stop name='wall', between='body','frame', clearance=0.0, law='rigid', restitution=1.0 /"//nl// &
                              "&load on='body', amplitude=1.0, angular_frequency=2.2, phase=90.0 /"//nl// &
                              "&initial on='body', displacement=-0.5 /"//nl//"&motion t_end=1.0, start='given' /"//nl// &
                              "&record observable='displacement', what='extrema' /"//nl

   !> x'' + 0.1 x' + f(x) = 0.1 + 0.05 cos ωt, with f = 0 for |x| < 1 and springs of stiffness 1 beyond.
   character(*), parameter :: dead_zone = "&scene kind='lumped' /"//nl//"&mass name='body', value=1.0 /"//nl// &
                              "&damper between='body','frame', damping=0.1 /"//nl// &
                              "&stop name='gap', between='body','frame', side='both', clearance=1.0, stiffness=1.0 /"//nl// &
                              "&load on='body', value=0.1, amplitude=0.05, angular_frequency=0.6, phase=90.0 /"//nl// &
                              "&initial on='body', displacement=1.1 /"//nl//"&motion t_end=1.0, start='given' /"//nl// &
                              "&record observable='displacement', what='extrema' /"//nl

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

   !> What is found in an input.
   subroutine compute(task, text)
      type(follow_t), intent(out) :: task
      character(*), intent(in) :: text

      type(error_t), allocatable :: error

      call new_request(task, input_of(text), error)
      if (.not. allocated(error)) call task%compute(error)
      if (allocated(error)) error stop error%message
   end subroutine compute

end module study_samples
