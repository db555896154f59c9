!! Shafts without mass. Coordinates whose rows in M are zero follow the others, q_light = -K_ll⁻¹ K_lo q_own.
!!
!! That is no approximation as long as nothing but springs acts on them: forces on them would move them beside this, damping
!! would make them states of their own.
module razy_rotor_reduction_condensation
   use razy_core_error, only: error_t, raise
   use razy_core_kinds, only: wp
   use razy_linalg_banded, only: band_factor_t
   use razy_linalg_null_space, only: null_space
   use razy_linalg_sparse, only: csr_t
   use razy_rotor_free_motions, only: moves_of, rigid_motions
   use razy_rotor_model, only: rotor_model_t
   use razy_rotor_reduction_reduced, only: new_reduced, reduced_t
   implicit none(type, external)
   private

   public :: condense

contains

   !> The model in those of its own coordinates that have mass. An error names a coordinate that cannot be left out.
   subroutine condense(reduced, model, error)
      type(reduced_t), intent(out) :: reduced
      type(rotor_model_t), intent(in) :: model
      type(error_t), allocatable, intent(out) :: error

      type(band_factor_t) :: factor
      real(wp), allocatable :: basis(:, :), force(:)
      integer, allocatable :: light(:), own(:)
      integer :: i, info, j

      own = pack([(i, i=1, model%numbering%n)], model%mass%diagonal() > 0.0_wp)
      light = pack([(i, i=1, model%numbering%n)],.not. model%mass%diagonal() > 0.0_wp)
      if (size(light) == 0) then
         reduced = new_reduced(model)
         return
      end if
      call factor%factor(model%stiffness%extract(light), info)
      if (size(own) == 0) call raise(error, "nothing has mass or inertia: give a node a &disk with it")
      if (.not. allocated(error)) call check_held(model, own, light, error)
      if (.not. allocated(error)) call check_springs(model, light, error)
      if (info /= 0 .and. .not. allocated(error)) call raise(error, "the stiffness of the nodes without mass is not positive")
      if (allocated(error)) return
      allocate (basis(model%numbering%n, size(own)), source=0.0_wp)
      do j = 1, size(own)
         basis(own(j), j) = 1.0_wp
         force = model%stiffness%times(basis(:, j))
         basis(light, j) = -factor%solve(force(light))
      end do
      reduced = new_reduced(model, basis)
      reduced%own = own
   end subroutine condense

   !> Refuse a motion that no spring holds and in which no mass moves.
   subroutine check_held(model, own, light, error)
      type(rotor_model_t), intent(in) :: model
      integer, intent(in) :: own(:), light(:)
      type(error_t), allocatable, intent(out) :: error

      real(wp), allocatable :: motion(:, :), moves(:, :), untouched(:, :)
      integer :: info

      call rigid_motions(model, .false., .false., .false., .false., motion, untouched)
      moves = moves_of(model, motion)
      call null_space(transpose(moves(own, :)), motion, info)
      if (info == 0 .and. size(motion, 2) == 0) return
      call raise(error, name_of(model, light(maxloc(abs(matmul(moves(light, :), motion(:, 1))), dim=1)))// &
                 " is free to move without mass or inertia: hold it by a &support, leave the motion out by &freedom, or "// &
                 "give a &disk its mass or inertia")
   end subroutine check_held

   !> Refuse whatever acts on a coordinate without mass and is no symmetric spring.
   subroutine check_springs(model, light, error)
      type(rotor_model_t), intent(in) :: model
      integer, intent(in) :: light(:)
      type(error_t), allocatable, intent(out) :: error

      logical :: tabled(model%numbering%n)
      integer :: at(6), i, k

      tabled = .false.
      do i = 1, size(model%rotor%bearing)
         at = model%numbering%of(model%rotor%bearing(i)%shaft, model%rotor%bearing(i)%node)
         if (allocated(model%rotor%bearing(i)%table)) tabled(pack(at, at > 0)) = .true.
      end do
      do k = 1, size(light)
         i = light(k)
         if (.not. (tabled(i) .or. acts(model%damping, i) .or. acts(model%gyroscopic, i) .or. acts(model%cross_stiffness, i) .or. &
                    acts(model%cross_damping, i) .or. any(abs(model%mesh_direction(i, :)) > 0.0_wp) &
                    .or. any(abs(model%unbalance(i, :)) > 0.0_wp))) cycle
         call raise(error, name_of(model, i)//" has no mass or inertia, so that only springs may act on it: no damping, cross "// &
                    "coupling, table, gyroscopic moment, gear or unbalance; give the node a &disk with it")
         return
      end do
   end subroutine check_springs

   !> Whether row i has entries.
   pure logical function acts(matrix, i)
      type(csr_t), intent(in) :: matrix
      integer, intent(in) :: i

      acts = any(abs(matrix%value(matrix%start(i):matrix%start(i + 1) - 1)) > 0.0_wp)
   end function acts

   function name_of(model, i) result(text)
      type(rotor_model_t), intent(in) :: model
      integer, intent(in) :: i
      character(:), allocatable :: text

      text = "'"//trim(model%numbering%name(model%rotor, i))//"'"
   end function name_of

end module razy_rotor_reduction_condensation
