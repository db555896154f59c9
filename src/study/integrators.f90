!! The integrator that a method names.
module razy_study_integrators
   use razy_core_error, only: error_t, raise
   use razy_exact_exact, only: exact_t
   use razy_motion_integrator, only: integrator_t
   use razy_moreau_moreau, only: moreau_t
   use razy_runge_kutta_runge_kutta, only: new_runge_kutta, runge_kutta_t
   use razy_motion_method, only: method_t
   implicit none(type, external)
   private

   public :: new_integrator

contains

   !> Make the integrator of a method that razy_motion_method has checked; one of the same kind is kept with what it knows.
   subroutine new_integrator(integrator, method, error)
      class(integrator_t), allocatable, intent(inout) :: integrator
      type(method_t), intent(in) :: method
      type(error_t), allocatable, intent(out) :: error

      select case (method%integrator)
      case ("exact")
         if (allocated(integrator)) then
            select type (integrator)
            type is (exact_t)
               integrator%most_steps = method%most_steps
               return
            end select
            deallocate (integrator)
         end if
         allocate (exact_t :: integrator)
         select type (integrator)
         type is (exact_t)
            integrator%most_steps = method%most_steps
         end select
      case ("rk4", "bogacki_shampine", "dormand_prince", "dop853", "radau5")
         if (allocated(integrator)) deallocate (integrator)
         allocate (runge_kutta_t :: integrator)
         select type (integrator)
         type is (runge_kutta_t)
            call new_runge_kutta(integrator, method)
         end select
      case ("moreau_jean")
         if (allocated(integrator)) deallocate (integrator)
         allocate (moreau_t :: integrator)
         select type (integrator)
         type is (moreau_t)
            integrator%step = method%step
            integrator%most_steps = method%most_steps
         end select
      case default
         call raise(error, "there is no integrator '"//trim(method%integrator)//"'")
      end select
   end subroutine new_integrator

end module razy_study_integrators
